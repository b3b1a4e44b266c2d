// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/render/engine.h"
#include "surface/row_slices.h"

namespace sarnerf {

/// ‖a − b‖₂ / ‖a‖₂ over rows from `first_row` on; NaN for a blank `a`.
double relative_difference(const Image<float>& a, const Image<float>& b, int first_row = 0);

/// scale · |a − b|; 0 in rows before `first_row`.
Image<float> error_map(const Image<float>& a, const Image<float>& b, int first_row, double scale);

/// The images of a view's coarser samplings, which its rows fill in passing. What they differ by from the
/// view's own tells how far that is from its limit.
class NestedImages {
 public:
  explicit NestedImages(const ViewPlan& plan);

  std::size_t n_levels() const { return images_.size(); }
  /// Level 0 has every third ray; level 1, there if errors are wanted by direction, all of them.
  static int k_step(std::size_t level) { return level == 0 ? kCoarser : 1; }
  /// Rows of a single slice have nothing coarser in them: their slice stands for the next row's instead.
  bool next_row() const { return next_row_; }

  /// Writes what row i of the view has gathered in a level's bins.
  void end_row(int i, std::size_t l, std::span<const double> bins, std::span<const double> beta0_per_mass);

  /// What they say about the view's image.
  ErrorEstimate estimate(const Image<float>& image) const;

 private:
  ErrorRequest request_;
  bool next_row_;
  std::vector<Image<float>> images_;
};

}  // namespace sarnerf
