// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// The true surface that an extracted one is compared with; world coordinates (m).
struct TruthSurface {
  SurfaceMesh solid;         ///< what volumes are taken from: closed pieces, which may overlap
  SurfaceMesh all;           ///< what distances are taken from
  std::size_t n_closed = 0;  ///< triangles of `all` that look outward; those behind them are seen from both sides
  /// `all`, with each open piece turned as a whole so that its outer side is outside: what winding numbers are taken of.
  /// Empty: `all` is so already.
  SurfaceMesh wound{};
};

/// The mesh of a scene as truth: closed pieces are the solid, and thin shells are surface alone. The ground plane is
/// no part of either. Which side of an open piece is outside, nobody says: it is turned so that together with fans from
/// its border to the border's centre it holds a positive volume. Cost: two copies of the mesh, three of an open one.
TruthSurface truth_of(const Scene& scene);

}  // namespace sarnerf
