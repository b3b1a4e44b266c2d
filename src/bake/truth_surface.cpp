// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/truth_surface.h"

namespace sarnerf {

TruthSurface truth_of(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  TruthSurface truth;
  truth.solid.vertices_m = mesh.vertices_m;
  const auto append = [&](SurfaceMesh& to, bool closed) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (scene.pieces[mesh.piece[t]].closed == closed) to.triangles.push_back(mesh.triangles[t]);
    }
  };
  append(truth.solid, true);
  truth.all = truth.solid;
  truth.n_closed = truth.solid.triangles.size();
  append(truth.all, false);
  return truth;
}

}  // namespace sarnerf
