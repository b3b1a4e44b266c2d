// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "appearance.h"
#include "view_rays.h"

namespace sarnerf {

/// Where a fan's rays meet the infinite ground plane, for engines that look at rays one by one. Each ray
/// stands for the ground of its step of angle, so that together they cover it without gaps.
class GroundRays {
 public:
  /// `rays` must outlive it.
  GroundRays(const ViewRays& rays, const Appearance& appearance, double height_m);

  /// Whether the plane looks the same everywhere: it needs no rays of its own then.
  bool uniform() const { return !appearance_.checker; }

  /// Range offset at which ray k meets the plane (m); infinite if it does not.
  double offset_m(int k) const { return offset_m_[static_cast<std::size_t>(k)]; }

  /// Adds what ray k of the row at a sees of the ground, times `weight`, in units of γ times ray steps.
  void deposit(int k, double along_track_m, double weight, std::span<double> bins) const;

 private:
  const ViewRays& rays_;
  Appearance appearance_;
  std::vector<double> offset_m_, gamma_;        ///< per ray
  std::vector<double> first_bin_, last_bin_;    ///< per ray: between which it covers the ground
};

}  // namespace sarnerf
