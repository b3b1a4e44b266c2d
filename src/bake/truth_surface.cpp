// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/truth_surface.h"

#include <map>
#include <span>
#include <utility>
#include <vector>

namespace sarnerf {
namespace {

/// Six times the volume between triangles and an apex.
double six_volumes(const SurfaceMesh& mesh, std::span<const std::uint32_t> triangles, const glm::dvec3& apex_m) {
  double sum = 0.0;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3& c = mesh.triangles[t];
    sum += glm::dot(mesh.vertices_m[c.x] - apex_m,
                    glm::cross(mesh.vertices_m[c.y] - apex_m, mesh.vertices_m[c.z] - apex_m));
  }
  return sum;
}

/// Centre of the edges that one of the triangles has alone, by their lengths; of none, the first corner.
glm::dvec3 centre_of_border(const SurfaceMesh& mesh, std::span<const std::uint32_t> triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> n_of_edge;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3& c = mesh.triangles[t];
    for (int corner = 0; corner < 3; ++corner) ++n_of_edge[std::minmax(c[corner], c[(corner + 1) % 3])];
  }
  const glm::dvec3 origin_m = mesh.vertices_m[mesh.triangles[triangles.front()].x];
  glm::dvec3 sum(0.0);
  double length_m = 0.0;
  for (const auto& [edge, n] : n_of_edge) {
    if (n != 1) continue;
    const glm::dvec3 a = mesh.vertices_m[edge.first] - origin_m, b = mesh.vertices_m[edge.second] - origin_m;
    sum += 0.5 * (a + b) * glm::distance(a, b);
    length_m += glm::distance(a, b);
  }
  return length_m > 0.0 ? origin_m + sum / length_m : origin_m;
}

}  // namespace

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
  if (truth.n_closed == truth.all.triangles.size()) return truth;

  truth.wound = truth.all;
  std::map<std::uint32_t, std::vector<std::uint32_t>> open_pieces;  // triangles of `all`
  std::uint32_t next = static_cast<std::uint32_t>(truth.n_closed);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!scene.pieces[mesh.piece[t]].closed) open_pieces[mesh.piece[t]].push_back(next++);
  for (const auto& [piece, triangles] : open_pieces) {
    if (six_volumes(truth.all, triangles, centre_of_border(truth.all, triangles)) >= 0.0) continue;
    for (const std::uint32_t t : triangles) std::swap(truth.wound.triangles[t].y, truth.wound.triangles[t].z);
  }
  return truth;
}

}  // namespace sarnerf
