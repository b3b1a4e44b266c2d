// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "visible_extent.h"

namespace sarnerf {

/// Which rays of each azimuth row may meet matter: for each row the rays k of a fan, as separate ranges in
/// ascending order. Empty space between things costs nothing, however much there is of it.
class VisibleRays {
 public:
  /// `boxes_from_aim`: of matter, relative to the aim point, world axes. Cost: boxes times the rows that
  /// each of them reaches.
  VisibleRays(const Acquisition& acquisition, const Fan& fan, std::span<const Box> boxes_from_aim);

  std::span<const RayRange> row(int i) const { return rows_[static_cast<std::size_t>(i)]; }
  std::uint64_t n_rays() const;

 private:
  std::vector<std::vector<RayRange>> rows_;
};

}  // namespace sarnerf
