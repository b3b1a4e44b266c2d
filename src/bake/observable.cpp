// SPDX-License-Identifier: Apache-2.0
#include "observable.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sarnerf {

namespace {

/// Lines that one line of points stands for, along either axis: points are half a pixel apart where columns are an eighth of that.
constexpr std::uint32_t kStride = 8;

/// Intervals of one line.
std::span<const Columns::Interval> line_of(const Columns& columns, std::uint32_t i, std::uint32_t k) {
  const auto first = columns.intervals.begin() + static_cast<std::ptrdiff_t>(columns.row_begin[k]);
  const auto last = columns.intervals.begin() + static_cast<std::ptrdiff_t>(columns.row_begin[k + 1]);
  const auto [low, high] = std::equal_range(first, last, Columns::Interval{i, 0.0, 0.0},
                                            [](const auto& a, const auto& b) { return a.i < b.i; });
  return {low, high};
}

bool holds(std::span<const Columns::Interval> line, double y_m) {
  return std::any_of(line.begin(), line.end(), [&](const auto& part) { return y_m >= part.bottom_m && y_m < part.top_m; });
}

}  // namespace

HiddenSpace hidden_space(const Columns& extracted, const Columns& truth, const Box& truth_box_m, const Sight& truth_sight,
                         std::span<const Acquisition> views, const Monitor& monitor) {
  const ColumnLattice& lattice = truth.lattice;
  const double step_m = kStride * lattice.spacing_m;
  std::vector<glm::dvec3> points_m;
  std::vector<std::uint8_t> is_extracted;
  for (std::uint32_t k = kStride / 2; k < lattice.n_z; k += kStride) {
    for (std::uint32_t i = kStride / 2; i < lattice.n_x; i += kStride) {
      const glm::dvec3 foot(lattice.x_m + (i + 0.5) * lattice.spacing_m, 0.0, lattice.z_m + (k + 0.5) * lattice.spacing_m);
      const auto mine = line_of(extracted, i, k), its = line_of(truth, i, k);
      const bool in_box = foot.x > truth_box_m.min.x && foot.x < truth_box_m.max.x && foot.z > truth_box_m.min.z && foot.z < truth_box_m.max.z;
      const double top_m = mine.empty() ? truth_box_m.max.y : std::max(truth_box_m.max.y, mine.back().top_m);
      for (double y_m = truth_box_m.min.y + 0.5 * step_m; y_m < top_m; y_m += step_m) {
        const bool filled = holds(mine, y_m);
        if (holds(its, y_m) || !(filled || (in_box && y_m < truth_box_m.max.y))) continue;
        points_m.emplace_back(foot.x, y_m, foot.z);
        is_extracted.push_back(filled ? 1 : 0);
      }
    }
  }
  const std::vector<std::uint8_t> reached = truth_sight.reached(points_m, views, monitor);
  HiddenSpace space;
  const double cell_m3 = step_m * step_m * step_m;
  for (std::size_t n = 0; n < points_m.size(); ++n) {
    if (reached[n] != 0) continue;
    const glm::dvec3& p = points_m[n];
    if (is_extracted[n] != 0) space.extracted_m3 += cell_m3;
    if (glm::all(glm::greaterThan(p, truth_box_m.min)) && glm::all(glm::lessThan(p, truth_box_m.max))) space.whole_m3 += cell_m3;
  }
  return space;
}

}  // namespace sarnerf
