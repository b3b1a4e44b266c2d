// SPDX-License-Identifier: Apache-2.0
#include "view_interpolation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/evaluation/baseline.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

namespace {

/// Angles that differ by less than this are equal: far above the rounding of angles in degrees, far below any step of a
/// sweep. It also keeps rounding from deciding ties, as in the middle of a gap.
constexpr double kSameAngle_rad = 1e-9;

constexpr std::size_t kNearest = 6;  ///< of nearest_azimuths()

/// Angle from one azimuth to another in the direction of growing azimuths, in [0, 2π).
double turn_rad(double from_rad, double to_rad) {
  const double turn = std::remainder(to_rad - from_rad, 2.0 * kPi);
  if (std::abs(turn) < kSameAngle_rad) return 0.0;
  return turn < 0.0 ? turn + 2.0 * kPi : turn;
}

}  // namespace

std::vector<const PosedImage*> checked_views(std::span<const PosedImage> training) {
  if (training.empty())
    throw UsageError("views are interpolated between training images; there is none");
  std::vector<const PosedImage*> views;
  for (const PosedImage& image : training) {
    const Acquisition& a = image.acquisition;
    validate(a);
    if (image.power.n_azimuth() != a.n_azimuth || image.power.n_range() != a.n_range) {
      throw UsageError(image.name + ": " + std::to_string(image.power.n_azimuth()) + " x " +
                       std::to_string(image.power.n_range()) +
                       " pixels where its acquisition says " + std::to_string(a.n_azimuth) + " x " +
                       std::to_string(a.n_range));
    }
    views.push_back(&image);
  }
  return views;
}

std::vector<Pitch> pitches(Views training) {
  std::vector<double> incidence_rad;
  for (const PosedImage* image : training) incidence_rad.push_back(image->acquisition.incidence_rad);
  std::vector<Pitch> all;
  for (const std::vector<std::size_t>& places : indices_by_pitch(incidence_rad)) {
    Pitch& pitch = all.emplace_back();
    for (const std::size_t n : places) {
      pitch.views.push_back(training[n]);
      // A running mean: the mean of equal incidences is exact.
      pitch.incidence_rad += (incidence_rad[n] - pitch.incidence_rad) / double(pitch.views.size());
    }
  }
  return all;
}

Neighbour nearest_view(Views training, const Acquisition& wanted) {
  const glm::dvec3 sight = radar_frame(wanted).k;
  const PosedImage* nearest = nullptr;
  double smallest = std::numeric_limits<double>::infinity();
  for (const PosedImage* image : training) {
    const double chord = glm::length(radar_frame(image->acquisition).k - sight);
    if (chord < smallest - kSameAngle_rad) {
      smallest = chord;
      nearest = image;
    }
  }
  return {nearest, 1.0};
}

std::vector<Neighbour> azimuth_neighbours(const Pitch& pitch, const Acquisition& wanted) {
  struct Side {
    const PosedImage* view = nullptr;
    double turn_rad = std::numeric_limits<double>::infinity();
    double tilt_rad = 0.0;
  };
  const auto offer = [](Side& side, const Side& other) {
    const double further = other.turn_rad - side.turn_rad;
    if (further < -kSameAngle_rad ||
        (further < kSameAngle_rad && other.tilt_rad < side.tilt_rad - kSameAngle_rad)) {
      side = other;
    }
  };
  Side before, after;
  for (const PosedImage* view : pitch.views) {
    const Acquisition& a = view->acquisition;
    const double tilt = std::abs(a.incidence_rad - wanted.incidence_rad);
    offer(before, {view, turn_rad(a.azimuth_rad, wanted.azimuth_rad), tilt});
    offer(after, {view, turn_rad(wanted.azimuth_rad, a.azimuth_rad), tilt});
  }
  if (before.view == after.view) return {{before.view, 1.0}};
  const double gap = before.turn_rad + after.turn_rad;
  return {{before.view, after.turn_rad / gap}, {after.view, before.turn_rad / gap}};
}

std::vector<Neighbour> nearest_azimuths(const Pitch& pitch, const Acquisition& wanted) {
  struct Distance {
    double turn_rad, tilt_rad;
    const PosedImage* view;
  };
  std::vector<Distance> sorted;
  for (const PosedImage* view : pitch.views) {
    const Acquisition& a = view->acquisition;
    sorted.push_back({std::abs(std::remainder(a.azimuth_rad - wanted.azimuth_rad, 2.0 * kPi)),
                      std::abs(a.incidence_rad - wanted.incidence_rad), view});
  }
  // Rounded to kSameAngle_rad, so that the order is a strict weak one.
  const auto key = [](const Distance& d) {
    return std::pair(std::llround(d.turn_rad / kSameAngle_rad),
                     std::llround(d.tilt_rad / kSameAngle_rad));
  };
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Distance& a, const Distance& b) { return key(a) < key(b); });
  const std::size_t count = std::min(sorted.size(), kNearest);
  std::vector<Neighbour> neighbours;
  for (std::size_t n = 0; n < count; ++n)
    neighbours.push_back({sorted[n].view, 1.0 / double(count)});
  return neighbours;
}

const Pitch& nearest_pitch(std::span<const Pitch> all, double incidence_rad) {
  const Pitch* nearest = &all.front();
  for (const Pitch& pitch : all) {
    if (std::abs(pitch.incidence_rad - incidence_rad) <
        std::abs(nearest->incidence_rad - incidence_rad) - kSameAngle_rad) {
      nearest = &pitch;
    }
  }
  return *nearest;
}

std::vector<Neighbour> neighbours_of_two_pitches(
    std::span<const Pitch> all, const Acquisition& wanted,
    std::vector<Neighbour> (*of_pitch)(const Pitch&, const Acquisition&)) {
  const auto above = std::find_if(all.begin(), all.end(), [&](const Pitch& pitch) {
    return pitch.incidence_rad > wanted.incidence_rad - kSameAngle_rad;
  });
  if (above == all.end()) return of_pitch(all.back(), wanted);
  const double beyond = above->incidence_rad - wanted.incidence_rad;
  if (above == all.begin() || beyond < kSameAngle_rad) return of_pitch(*above, wanted);

  const Pitch& below = *(above - 1);
  const double weight_below = beyond / (above->incidence_rad - below.incidence_rad);
  std::vector<Neighbour> neighbours = of_pitch(below, wanted);
  for (Neighbour& n : neighbours) n.weight *= weight_below;
  for (const Neighbour& n : of_pitch(*above, wanted)) {
    neighbours.push_back({n.view, n.weight * (1.0 - weight_below)});
  }
  return neighbours;
}

namespace {

bool same_sight(const Acquisition& a, const Acquisition& b) {
  return std::abs(std::remainder(a.azimuth_rad - b.azimuth_rad, 2.0 * kPi)) < 1e-12 &&
         std::abs(a.incidence_rad - b.incidence_rad) < 1e-12 &&
         std::abs(a.slant_range_m - b.slant_range_m) < 1e-12 * a.slant_range_m;
}

/// Snaps nearly whole positions: rounding errors would blur an image that lies exactly on the grid.
double settle(double position) {
  const double whole = std::round(position);
  return std::abs(position - whole) < 1e-6 ? whole : position;
}

}  // namespace

WarpedView::WarpedView(const PosedImage& image, const Acquisition& wanted, Warp warp,
                       double plane_height_m, Resampling resampling)
    : image_(image), view_(image.acquisition), wanted_(wanted), frame_(radar_frame(view_)) {
  if (resampling == Resampling::cubic) amplitude_ = amplitude_of(image.power);
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
  // project() without the ray angle, which would take most of the time.
  const glm::dvec3 q = point - view_.aim_m;
  const double r = view_.slant_range_m, along_k = glm::dot(q, frame_.k),
               along_v = glm::dot(q, frame_.v);
  const double range = std::sqrt((r + along_k) * (r + along_k) + along_v * along_v);
  return at(glm::dot(q, frame_.h),
            (along_k * (2.0 * r + along_k) + along_v * along_v) / (range + r));
}

double WarpedView::at(double along_track_m, double range_offset_m) const {
  const double row = settle(view_.row_of(along_track_m)), bin = settle(view_.bin_of(range_offset_m));
  if (amplitude_.pixels().empty()) return bilinear(image_.power, row, bin);
  const double amplitude = std::max(0.0, cubic(amplitude_, row, bin));
  return amplitude * amplitude;
}

namespace {

Warp warp_of(Interpolation method) {
  switch (method) {
    case Interpolation::rescaled_linear:
      return Warp::rescale;
    case Interpolation::rotated_linear:
    case Interpolation::rotated_bilinear:
    case Interpolation::rotated_mean:
    case Interpolation::rotated_mean_bipitch:
      return Warp::turn;
    default:
      return Warp::none;
  }
}

std::vector<Neighbour> neighbours_of(Views training, const Acquisition& wanted,
                                     Interpolation method) {
  if (method == Interpolation::nearest) return {nearest_view(training, wanted)};
  const std::vector<Pitch> all = pitches(training);
  switch (method) {
    case Interpolation::bilinear:
    case Interpolation::rotated_bilinear:
      return neighbours_of_two_pitches(all, wanted, azimuth_neighbours);
    case Interpolation::rotated_mean:
      return nearest_azimuths(nearest_pitch(all, wanted.incidence_rad), wanted);
    case Interpolation::rotated_mean_bipitch:
      return neighbours_of_two_pitches(all, wanted, nearest_azimuths);
    default:
      return azimuth_neighbours(nearest_pitch(all, wanted.incidence_rad), wanted);
  }
}

}  // namespace

std::string_view name(Interpolation method) {
  switch (method) {
    case Interpolation::nearest:
      return "nearest view";
    case Interpolation::linear:
      return "linear in azimuth";
    case Interpolation::rescaled_linear:
      return "range rescaled, then linear";
    case Interpolation::rotated_linear:
      return "rotated, then linear";
    case Interpolation::bilinear:
      return "bilinear in pitch and azimuth";
    case Interpolation::rotated_bilinear:
      return "rotated, then bilinear";
    case Interpolation::rotated_mean:
      return "rotated, mean of six";
    case Interpolation::rotated_mean_bipitch:
      return "rotated, mean of six at two pitches";
  }
  return "";
}

bool supposes_plane(Interpolation method) { return warp_of(method) != Warp::none; }

std::vector<Interpolation> interpolations_for(std::span<const PosedImage> training) {
  using enum Interpolation;
  if (training.empty()) return {};
  if (pitches(checked_views(training)).size() == 1) return {nearest, linear, rotated_linear};
  return {nearest, linear, rescaled_linear, rotated_linear, bilinear, rotated_bilinear};
}

std::vector<Interpolation> despeckling_for(std::span<const PosedImage> training) {
  using enum Interpolation;
  if (training.empty()) return {};
  if (pitches(checked_views(training)).size() == 1) return {rotated_linear, rotated_mean};
  return {rotated_linear, rotated_mean, rotated_mean_bipitch};
}

Image<float> interpolate_between(Views training, const Acquisition& wanted, Interpolation method,
                                 double plane_height_m, Average average, Resampling resampling) {
  return weighted_mean(neighbours_of(training, wanted, method), wanted, warp_of(method),
                       plane_height_m, average, resampling);
}

Image<float> weighted_mean(std::span<const Neighbour> neighbours, const Acquisition& wanted,
                           Warp warp, double plane_height_m, Average average, Resampling resampling) {
  std::vector<WarpedView> views;
  views.reserve(neighbours.size());
  for (const Neighbour& n : neighbours) views.emplace_back(*n.view, wanted, warp, plane_height_m, resampling);

  Image<float> image(wanted.n_azimuth, wanted.n_range);
  parallel_for(static_cast<std::size_t>(wanted.n_azimuth), 16,
               [&](std::size_t begin, std::size_t end, int) {
                 for (int i = static_cast<int>(begin); i < static_cast<int>(end); ++i) {
                   for (int j = 0; j < wanted.n_range; ++j) {
                     double sum = 0.0;
                     for (std::size_t n = 0; n < views.size(); ++n) {
                       const double power = views[n].value(i, j);
                       sum += neighbours[n].weight *
                              (average == Average::power ? power : std::sqrt(std::max(0.0, power)));
                     }
                     image(i, j) = static_cast<float>(sum);
                   }
                 }
               });
  return image;
}

Image<float> interpolate_view(std::span<const PosedImage> training, const Acquisition& wanted,
                              Interpolation method, double plane_height_m, Resampling resampling) {
  validate(wanted);
  return interpolate_between(checked_views(training), wanted, method, plane_height_m, Average::power, resampling);
}

}  // namespace sarnerf
