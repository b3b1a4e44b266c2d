// SPDX-License-Identifier: Apache-2.0
#include <sarnerf/core/units.h>
#include <sarnerf/geometry/acquisition.h>

#include <cmath>
#include <cstdio>

/// The aim point is seen in the middle of the image, at its own range, under ray angle 0.
int main() {
  sarnerf::Acquisition view;
  view.incidence_rad = sarnerf::rad_from_deg(35.0);
  view.slant_range_m = 10'000.0;
  view.aim_m = {500'000.0, 120.0, -4'000'000.0};
  view.n_azimuth = view.n_range = 128;
  view.azimuth_spacing_m = view.range_spacing_m = 0.3;
  sarnerf::validate(view);

  const auto seen = sarnerf::project(view, sarnerf::radar_frame(view), view.aim_m);
  std::printf("along track %g m, range offset %g m\n", seen.along_track_m, seen.range_offset_m);
  return std::abs(seen.along_track_m) + std::abs(seen.range_offset_m) < 1e-9 ? 0 : 1;
}
