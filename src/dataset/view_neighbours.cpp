// SPDX-License-Identifier: Apache-2.0
#include "view_neighbours.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

namespace sarnerf {
namespace {

/// Angles nearer than this are one: far above the rounding of angles in degrees, far below any step of a sweep. It
/// also keeps ties, as in the middle of a gap, from being decided by rounding.
constexpr double kSameAngle_rad = 1e-9;

constexpr double kPitchGap_rad = rad_from_deg(0.25);

constexpr std::size_t kNearest = 6;  ///< of nearest_azimuths()

/// How far to turn from one azimuth to another in the direction of growing azimuths, in [0, 2π).
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
  std::vector<double> sorted;
  for (const PosedImage* image : training) sorted.push_back(image->acquisition.incidence_rad);
  std::sort(sorted.begin(), sorted.end());

  std::vector<double> last_of_pitch;
  for (std::size_t n = 0; n < sorted.size(); ++n) {
    if (n + 1 == sorted.size() || sorted[n + 1] - sorted[n] > kPitchGap_rad)
      last_of_pitch.push_back(sorted[n]);
  }
  std::vector<Pitch> all(last_of_pitch.size());
  for (const PosedImage* image : training) {
    const double incidence = image->acquisition.incidence_rad;
    const auto place = std::lower_bound(last_of_pitch.begin(), last_of_pitch.end(), incidence);
    Pitch& pitch = all[static_cast<std::size_t>(place - last_of_pitch.begin())];
    pitch.views.push_back(image);
    // A running mean: equal incidences have exactly their own.
    pitch.incidence_rad += (incidence - pitch.incidence_rad) / double(pitch.views.size());
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
  // Rounded to what counts as one angle, so that the order stays a strict one.
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

}  // namespace sarnerf
