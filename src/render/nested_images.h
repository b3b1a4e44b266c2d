// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "nested_sampling.h"
#include "sarnerf/render/engine.h"

namespace sarnerf {

/// The images of a view's coarser samplings, which its rows fill in passing. What they differ by from the
/// view's own tells how far that is from its limit.
class NestedImages {
 public:
  explicit NestedImages(const ViewPlan& plan);

  std::size_t n_levels() const { return levels_.size(); }
  const NestedLevel& level(std::size_t l) const { return levels_[l]; }

  /// Writes what row i of the view has gathered in a level's bins.
  void end_row(int i, std::size_t l, std::span<const double> bins, std::span<const double> beta0_per_mass);

  /// What they say about the view's image.
  ErrorEstimate estimate(const Image<float>& image) const;

 private:
  ErrorRequest request_;
  std::vector<NestedLevel> levels_;
  std::vector<Image<float>> images_;
};

}  // namespace sarnerf
