// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "column_lattice.h"
#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/monitor.h"

namespace sarnerf {

/// What a solid holds of the lines of a lattice: the heights between which its winding number is above zero.
/// Overlapping closed pieces thus become their union, cavities stay empty, and a mesh that looks inward holds
/// nothing. Memory: 24 bytes an interval.
struct Columns {
  struct Interval {
    std::uint32_t i = 0;  ///< column along x
    double bottom_m = 0.0;
    double top_m = 0.0;
  };

  ColumnLattice lattice;
  std::vector<std::size_t> row_begin;  ///< [n_z + 1]: intervals of lattice row k, by column, then by height
  std::vector<Interval> intervals;     ///< those of one column do not overlap
  std::uint64_t n_met = 0;             ///< lines that meet the surface
  std::uint64_t n_open = 0;  ///< of these, lines whose winding number does not return to zero: the mesh has holes

  double volume_m3() const;
};

/// Crosses a mesh with the lines. Each line's crossings with a closed mesh cancel exactly, also where it runs
/// through an edge, a corner or along a wall: neighbouring triangles share the rounded ends of their spans, which
/// hold one of both borders. Vertical triangles have no span. The part of a line above the last crossing belongs
/// to no solid. Expects corners that exist and finite coordinates. Throws Interrupted on request. Cost:
/// proportional to the pairs of rows and triangles that meet, and to the crossings, on all threads.
Columns columns_of(const SurfaceMesh& mesh, const ColumnLattice& lattice, const Monitor& monitor = {});

/// Volume of the intersection of two solids over the same lattice (m³).
double common_volume_m3(const Columns& a, const Columns& b);

}  // namespace sarnerf
