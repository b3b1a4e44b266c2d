// SPDX-License-Identifier: Apache-2.0
#include "column_lattice.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr double kDefaultCells = 512.0;
constexpr double kMostCells = 8192.0;

}  // namespace

ColumnLattice column_lattice(const Box& box, double spacing_m) {
  if (!(std::isfinite(spacing_m) && spacing_m >= 0.0)) {
    throw UsageError("the spacing of the columns must be a positive length in metres, or 0 to choose one; it is " +
                     std::to_string(spacing_m));
  }
  if (box.empty()) return {};
  const double longest_m = std::max(box.size().x, box.size().z);
  if (spacing_m == 0.0) spacing_m = longest_m > 0.0 ? longest_m / kDefaultCells : 1.0;
  const double most = longest_m / spacing_m;
  if (!(most <= kMostCells)) {
    throw UsageError("columns of " + std::to_string(spacing_m) + " m over " + std::to_string(longest_m) +
                     " m are too many: at most 8192 a side, so at least " +
                     std::to_string(longest_m / kMostCells) + " m");
  }
  // Without the tolerance, 512.0000001 cells would be 513 of them.
  const auto count = [&](double side_m) {
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(side_m / spacing_m - 1e-6)));
  };
  return {box.min.x, box.min.z, spacing_m, count(box.size().x), count(box.size().z)};
}

std::uint32_t first_line(double coordinate_m, double corner_m, double spacing_m, std::uint32_t n) {
  const double line = std::ceil((coordinate_m - corner_m) / spacing_m - 0.5);
  return static_cast<std::uint32_t>(std::clamp(line, 0.0, static_cast<double>(n)));
}

}  // namespace sarnerf
