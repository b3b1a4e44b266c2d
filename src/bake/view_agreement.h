// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "return_map.h"

namespace sarnerf {

/// What views say together of a place: empty when a share of those that hold it see it in front of what their rays meet,
/// or past it; else full, since nobody sees inside of opaque matter. A single view may err. One per thread.
class ViewAgreement {
 public:
  ViewAgreement(std::span<const ReturnMap> maps, double agreeing_share, double voxel_m)
      : maps_(maps), agreeing_share_(agreeing_share), voxel_m_(voxel_m) {}

  /// 1 in matter and behind it, 0 in front; ½ on the surface, over two voxels. 0 where no view looks.
  float occupancy(const glm::dvec3& point_m);

 private:
  std::span<const ReturnMap> maps_;
  double agreeing_share_, voxel_m_;
  std::size_t first_ = 0, begin_ = 0;
  std::vector<double> distances_;
};

/// Share of the views that must agree on what is empty: a tenth, or four tenths where a tenth errs.
///
/// A tenth keeps undercuts, into which few views see. But of a smooth wall that is dim beside what it bears, grazing
/// views learn nothing, and a tenth of them carve the house behind it. Then much of the power seems to come out of empty
/// space: more than a tenth of it is returned where the body does not begin within two and a half learned voxels behind.
/// If four tenths leave little of that, they are taken. Only power from above `floor_m` counts. Deterministic; 20,000 rays.
double agreeing_share(std::span<const ReturnMap> maps, double learned_voxel_m, std::optional<double> floor_m);

}  // namespace sarnerf
