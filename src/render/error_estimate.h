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

/// The images of a view's coarser samplings, filled from the same hits as the view's rows. Their difference from
/// the view's image gives an estimate of its error.
class NestedImages {
 public:
  explicit NestedImages(const ViewPlan& plan);

  std::size_t n_levels() const { return images_.size(); }
  /// Level 0 takes every third ray. Level 1 takes all rays; it exists only if errors are wanted by direction.
  static int k_step(std::size_t level) { return level == 0 ? kCoarser : 1; }
  /// Rows of a single slice contain no coarser sampling: each is compared with the previous row's slice.
  bool next_row() const { return next_row_; }

  /// Writes the bins that row i of the view has gathered for level l.
  void end_row(int i, std::size_t l, std::span<const double> bins, std::span<const double> beta0_per_mass);

  /// Estimates the error of the view's image.
  ErrorEstimate estimate(const Image<float>& image) const;

 private:
  ErrorRequest request_;
  bool next_row_;
  std::vector<Image<float>> images_;
};

}  // namespace sarnerf
