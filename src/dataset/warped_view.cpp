// SPDX-License-Identifier: Apache-2.0
#include "warped_view.h"

#include <cmath>
#include <limits>

#include "sarnerf/core/units.h"

namespace sarnerf {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

bool same_sight(const Acquisition& a, const Acquisition& b) {
  return std::abs(std::remainder(a.azimuth_rad - b.azimuth_rad, 2.0 * kPi)) < 1e-12 &&
         std::abs(a.incidence_rad - b.incidence_rad) < 1e-12 &&
         std::abs(a.slant_range_m - b.slant_range_m) < 1e-12 * a.slant_range_m;
}

/// Horizontal distance from the aim point of what each bin sees of the plane `height_m` above it (m); nowhere in bins
/// that are nearer than the plane. The difference of g and r sin θ is formed from g² − r² sin² θ, which keeps large
/// numbers from cancelling.
std::vector<double> plane_offsets_m(const Acquisition& a, double height_m) {
  const double r = a.slant_range_m, aim = r * std::sin(a.incidence_rad);
  const double lift = height_m * (2.0 * a.altitude_m() - height_m);
  std::vector<double> offsets;
  for (int j = 0; j < a.n_range; ++j) {
    const double s = a.bin_offset_m(j);
    const double farther = s * (2.0 * r + s) + lift;  // g² − r² sin² θ
    const double g2 = aim * aim + farther;
    offsets.push_back(g2 >= 0.0 ? farther / (std::sqrt(g2) + aim) : kNowhere);
  }
  return offsets;
}

/// Nearly whole positions are whole: what rounding adds would blur an image that lies exactly on the grid.
double settle(double position) {
  const double whole = std::round(position);
  return std::abs(position - whole) < 1e-6 ? whole : position;
}

/// Bilinear value at a position in pixels, 0 beyond the border and at no position.
double value_at(const Image<float>& image, double i, double j) {
  if (!(i > -1.0 && i < image.n_azimuth() && j > -1.0 && j < image.n_range())) return 0.0;
  const int i0 = static_cast<int>(std::floor(i)), j0 = static_cast<int>(std::floor(j));
  const double wi[2] = {1.0 - (i - i0), i - i0}, wj[2] = {1.0 - (j - j0), j - j0};
  double sum = 0.0;
  for (int a = 0; a < 2; ++a) {
    if (i0 + a < 0 || i0 + a >= image.n_azimuth()) continue;
    for (int b = 0; b < 2; ++b) {
      if (j0 + b < 0 || j0 + b >= image.n_range()) continue;
      sum += wi[a] * wj[b] * double(image(i0 + a, j0 + b));
    }
  }
  return sum;
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
  away_ = {-std::sin(seen.azimuth_rad), 0.0, -std::cos(seen.azimuth_rad)};
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
  return value_at(image_.power,
                  settle(along_track_m / view_.azimuth_spacing_m + 0.5 * (view_.n_azimuth - 1)),
                  settle(range_offset_m / view_.range_spacing_m + 0.5 * (view_.n_range - 1)));
}

}  // namespace sarnerf
