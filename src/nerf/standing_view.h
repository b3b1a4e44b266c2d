// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// The part of a view that shows what stands on a level ground: its layover, itself and its shadow, with the ground
/// there. Rays of these angles make all of these bins.
struct StandingView {
  double least_angle_rad, most_angle_rad;  ///< ray angles δ
  int first_bin, end_bin;                  ///< within the image
};

/// Of what stands inside `standing_m`, relative to the aim point like the plane's height. Where the plane leaves the
/// image, there is no limit on that side.
StandingView standing_view(const Acquisition& acquisition, const Box& standing_m, double ground_height_m);

}  // namespace sarnerf
