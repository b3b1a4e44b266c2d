// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// Square lattice over the horizontal plane. Through the centre of each cell goes one vertical line:
/// line (i, k) at x = x_m + (i + ½) spacing_m, z = z_m + (k + ½) spacing_m.
struct ColumnLattice {
  double x_m = 0.0;  ///< corner of cell (0, 0), world coordinates
  double z_m = 0.0;
  double spacing_m = 1.0;
  std::uint32_t n_x = 0;
  std::uint32_t n_z = 0;
};

/// The lattice over a box; of an empty box, one without cells. A spacing of 0 gives about 512 cells along the
/// box's longer side. Throws UsageError for a spacing that is negative, not finite, or gives more than 8192 cells
/// a side.
ColumnLattice column_lattice(const Box& box, double spacing_m);

/// The first of n lines, `spacing_m` apart and half a spacing behind `corner_m` the first, at or beyond a
/// coordinate; n when there is none. Monotonic in the coordinate and a function of it alone: all that must agree
/// between neighbouring triangles goes through here.
std::uint32_t first_line(double coordinate_m, double corner_m, double spacing_m, std::uint32_t n);

}  // namespace sarnerf
