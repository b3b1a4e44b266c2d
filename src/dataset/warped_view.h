// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// What is done to a training image before it counts.
enum class Warp { none, rescale, turn };

/// A training image on the grid of the wanted view, looked up pixel by pixel. See interpolate_view().
class WarpedView {
 public:
  /// Both must outlive it.
  WarpedView(const PosedImage& image, const Acquisition& wanted, Warp warp, double plane_height_m);

  double value(int i, int j) const;

 private:
  double at(double along_track_m, double range_offset_m) const;

  const PosedImage& image_;
  Acquisition view_;
  const Acquisition& wanted_;
  RadarFrame frame_;
  RadarPoint aim_{};  ///< the wanted aim point as this view sees it
  bool through_plane_ = false, mirrored_ = false;
  double plane_height_m_ = 0.0;
  std::vector<double> plane_offset_m_;
  glm::dvec3 along_track_{0.0}, away_{0.0};
};

}  // namespace sarnerf
