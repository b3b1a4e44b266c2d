// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// The true surface that an extracted one is compared with; world coordinates (m).
struct TruthSurface {
  SurfaceMesh solid;  ///< closed pieces alone: what volumes are taken from. Pieces may overlap
  SurfaceMesh all;    ///< the triangles of `solid`, in their order, and behind them thin shells, seen from both sides
};

/// The mesh of a scene as truth. The ground plane is no part of it. Cost: one copy of the mesh.
TruthSurface truth_of(const Scene& scene);

}  // namespace sarnerf
