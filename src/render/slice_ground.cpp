// SPDX-License-Identifier: Apache-2.0
#include "slice_ground.h"

#include <cmath>
#include <limits>

#include "sarnerf/geometry/ray_grid.h"

namespace sarnerf {
namespace {

constexpr double kCoplanar_m = 1e-3;

}  // namespace

SliceGround::SliceGround(const Acquisition& view, double height_m)
    : slant_range_m_(view.slant_range_m),
      sine_(std::sin(view.incidence_rad)),
      cosine_(std::cos(view.incidence_rad)),
      above_ground_m_(view.aim_m.y - height_m) {
  const auto angles = ground_angular_extent(view, height_m);
  if (!angles) return;
  const double first = std::tan(angles->first), last = std::tan(angles->second);
  if (!(first < last)) return;
  const double depth_first = plane_depth(first), depth_last = plane_depth(last);
  const double across_first = (slant_range_m_ + depth_first) * first, across_last = (slant_range_m_ + depth_last) * last;
  line_ = SliceLine{first, last, depth_first, across_first, depth_last - depth_first, across_last - across_first,
                    kGroundFace};
}

double SliceGround::plane_depth(double tangent) const {
  // The height above the ground, above_ground − cos θ · depth + sin θ · (r + depth) · tangent, is zero there.
  return (above_ground_m_ + slant_range_m_ * sine_ * tangent) / (cosine_ - sine_ * tangent);
}

double SliceGround::depth_at(double tangent) const {
  const bool above_horizon = cosine_ - sine_ * tangent <= 1e-9, behind_nadir = sine_ + cosine_ * tangent <= 0.0;
  return above_horizon || behind_nadir ? std::numeric_limits<double>::infinity() : plane_depth(tangent);
}

void SliceGround::cover(std::span<const VisiblePiece> pieces, std::span<const SliceLine> lines, std::uint32_t ground,
                        std::vector<VisiblePiece>& all) const {
  all.clear();
  const auto add_ground = [&](double first, double last) {
    if (!line_) return;
    first = std::max(first, line_->first);
    last = std::min(last, line_->last);
    if (first < last) all.push_back({first, last, ground});
  };
  const double r = slant_range_m_;
  double done = -std::numeric_limits<double>::infinity();
  for (const VisiblePiece& p : pieces) {
    add_ground(done, p.first);
    done = p.last;
    const SliceLine& line = lines[p.line];
    const glm::dvec2 at_first(line.depth_at(p.first, r), depth_at(p.first));
    const glm::dvec2 at_last(line.depth_at(p.last, r), depth_at(p.last));
    const double behind_first = at_first.x - at_first.y, behind_last = at_last.x - at_last.y;
    if (std::max(behind_first, behind_last) <= kCoplanar_m) {
      all.push_back(p);
    } else if (std::min(behind_first, behind_last) >= 0.0) {
      add_ground(p.first, p.last);
    } else if (std::isinf(behind_first) || std::isinf(behind_last)) {
      all.push_back(p);  // it reaches beyond the horizon, which no bin does
    } else {
      const double middle = crossing(p.first, p.last, std::abs(behind_first), std::abs(behind_last), r + at_first,
                                     r + at_last);
      if (behind_first > 0.0) {
        add_ground(p.first, middle);
        all.push_back({middle, p.last, p.line});
      } else {
        all.push_back({p.first, middle, p.line});
        add_ground(middle, p.last);
      }
    }
  }
  add_ground(done, std::numeric_limits<double>::infinity());
}

}  // namespace sarnerf
