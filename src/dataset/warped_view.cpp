// SPDX-License-Identifier: Apache-2.0
#include "warped_view.h"

#include <cmath>

#include "sarnerf/core/bilinear.h"
#include "sarnerf/core/units.h"
#include "sarnerf/geometry/level_plane.h"

namespace sarnerf {
namespace {

bool same_sight(const Acquisition& a, const Acquisition& b) {
  return std::abs(std::remainder(a.azimuth_rad - b.azimuth_rad, 2.0 * kPi)) < 1e-12 &&
         std::abs(a.incidence_rad - b.incidence_rad) < 1e-12 &&
         std::abs(a.slant_range_m - b.slant_range_m) < 1e-12 * a.slant_range_m;
}

/// Nearly whole positions are whole: what rounding adds would blur an image that lies exactly on the grid.
double settle(double position) {
  const double whole = std::round(position);
  return std::abs(position - whole) < 1e-6 ? whole : position;
}

}  // namespace

WarpedView::WarpedView(const PosedImage& image, const Acquisition& wanted, Warp warp,
                       double plane_height_m)
    : image_(image), view_(image.acquisition), wanted_(wanted), frame_(radar_frame(view_)) {
  Acquisition seen = wanted;
  if (warp == Warp::rescale) seen.azimuth_rad = view_.azimuth_rad;
  through_plane_ = warp != Warp::none && !same_sight(seen, view_);
  mirrored_ = view_.look != wanted.look;
  view_.aim_m -= wanted.aim_m;  // points below are relative to the wanted aim
  aim_ = project(view_, frame_, glm::dvec3(0.0));
  if (!through_plane_) return;
  plane_height_m_ = plane_height_m;
  plane_offset_m_ = plane_offsets_m(seen, plane_height_m);
  along_track_ = radar_frame(seen).h;
  away_ = level_range_direction(seen);
}

double WarpedView::value(int i, int j) const {
  const double a_m = wanted_.row_offset_m(i);
  if (!through_plane_) {
    return at(aim_.along_track_m + (mirrored_ ? -a_m : a_m),
              aim_.range_offset_m + wanted_.bin_offset_m(j));
  }
  const double offset_m = plane_offset_m_[static_cast<std::size_t>(j)];
  if (std::isnan(offset_m)) return 0.0;
  const glm::dvec3 point =
      a_m * along_track_ + offset_m * away_ + glm::dvec3(0.0, plane_height_m_, 0.0);
  // project() without the ray angle, which would be most of the time.
  const glm::dvec3 q = point - view_.aim_m;
  const double r = view_.slant_range_m, along_k = glm::dot(q, frame_.k),
               along_v = glm::dot(q, frame_.v);
  const double range = std::sqrt((r + along_k) * (r + along_k) + along_v * along_v);
  return at(glm::dot(q, frame_.h),
            (along_k * (2.0 * r + along_k) + along_v * along_v) / (range + r));
}

double WarpedView::at(double along_track_m, double range_offset_m) const {
  return bilinear(image_.power,
                  settle(along_track_m / view_.azimuth_spacing_m + 0.5 * (view_.n_azimuth - 1)),
                  settle(range_offset_m / view_.range_spacing_m + 0.5 * (view_.n_range - 1)));
}

}  // namespace sarnerf
