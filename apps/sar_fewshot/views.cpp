// SPDX-License-Identifier: Apache-2.0
// Views that need no field: where views are wanted, and shots that are turned there, averaged, or measured there.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "generation.h"
#include "sarnerf/core/units.h"

namespace sarnerf::app {

std::vector<WantedView> wanted_views(std::span<const PosedImage> shots, const GenerationOptions& o, std::optional<double> depression_deg) {
  constexpr double kRounding_deg = 1e-9;
  std::vector<WantedView> views;
  for (std::size_t s = 0; s < shots.size(); ++s) {
    if (depression_deg) views.push_back({shots[s].acquisition, s, s});
    const std::size_t next = (s + 1) % shots.size();
    const double gap_deg = shots.size() == 1 ? 360.0 : std::fmod(azimuth_deg(shots[next]) - azimuth_deg(shots[s]) + 720.0, 360.0);
    const auto n_steps = std::lround(gap_deg / o.step_deg);
    for (long k = 1; k < n_steps; ++k) {
      const double from_deg = gap_deg * static_cast<double>(k) / static_cast<double>(n_steps);
      if (std::min(from_deg, gap_deg - from_deg) > o.reach_deg + kRounding_deg) continue;
      const std::size_t nearest = 2 * k <= n_steps ? s : next;
      WantedView& view = views.emplace_back(WantedView{shots[nearest].acquisition, nearest, nearest == s ? next : s});
      view.acquisition.azimuth_rad = shots[s].acquisition.azimuth_rad + rad_from_deg(from_deg);
    }
  }
  if (depression_deg)
    for (WantedView& view : views) view.acquisition.incidence_rad = rad_from_deg(90.0 - *depression_deg);
  return views;
}

namespace {

/// A shot that is continued at its edges by its mirror image, as far as turning it to a view brings in what lies outside of it: a chip whose
/// corners are black would give its arm away.
PosedImage with_room(const PosedImage& shot, const Acquisition& wanted) {
  const Acquisition& a = shot.acquisition;
  const double turn_rad = apart_rad(a.azimuth_rad, wanted.azimuth_rad), c = std::abs(std::cos(turn_rad)), s = std::abs(std::sin(turn_rad));
  const double along_m = 0.5 * kStoredSide * a.azimuth_spacing_m;  // half of what is kept, on the level plane
  const double range_m = 0.5 * kStoredSide * a.range_spacing_m / std::sin(wanted.incidence_rad);
  const double rows = (along_m * c + range_m * s) / a.azimuth_spacing_m;
  const double bins = (along_m * s + range_m * c) * std::sin(a.incidence_rad) / a.range_spacing_m;
  const double missing = std::max(rows - 0.5 * a.n_azimuth, bins - 0.5 * a.n_range);
  if (missing <= 0.0) return shot;
  const int margin = static_cast<int>(std::ceil(missing)) + 1;
  PosedImage wide{shot.name, a, Image<float>(a.n_azimuth + 2 * margin, a.n_range + 2 * margin)};
  wide.acquisition.n_azimuth += 2 * margin;
  wide.acquisition.n_range += 2 * margin;
  const auto inside = [](int k, int n) {
    const int period = 2 * n, phase = ((k % period) + period) % period;
    return phase < n ? phase : period - 1 - phase;
  };
  for (int i = 0; i < wide.acquisition.n_azimuth; ++i)
    for (int j = 0; j < wide.acquisition.n_range; ++j)
      wide.power(i, j) = shot.power(inside(i - margin, a.n_azimuth), inside(j - margin, a.n_range));
  return wide;
}

/// Of turned and of interpolated chips: bilinear resampling would smooth their speckle (docs/results/recognition_choices.md).
constexpr Resampling kResampling = Resampling::cubic;

}  // namespace

PosedImage turned(const PosedImage& shot, const Acquisition& wanted) {
  const PosedImage wide = with_room(shot, wanted);
  return {shot.name, wanted, interpolate_view(std::span(&wide, 1), wanted, Interpolation::rotated_linear, 0.0, kResampling)};
}

namespace {

/// Of the shots next to a view. Their depressions are nominal: shots of measured depressions, which differ by fractions of a degree, would
/// else count as neighbours of different pitches.
PosedImage interpolated(std::span<const PosedImage> shots, const Acquisition& wanted, Interpolation interpolation) {
  std::vector<PosedImage> wide;
  for (const PosedImage& shot : shots) {
    wide.push_back(with_room(shot, wanted));
    wide.back().acquisition.incidence_rad = shots.front().acquisition.incidence_rad;
  }
  return {"", wanted, interpolate_view(wide, wanted, interpolation, 0.0, kResampling)};
}

std::vector<PosedImage> turned_through_circle(std::span<const PosedImage> shots) {
  std::vector<PosedImage> views;
  for (const PosedImage& shot : shots)
    for (int k = 1; k < kTurnsOfCircle; ++k) {
      Acquisition wanted = shot.acquisition;
      wanted.azimuth_rad += rad_from_deg(360.0 * k / kTurnsOfCircle);
      views.push_back(turned(shot, wanted));
    }
  return views;
}

/// The measured chip nearest to a view in azimuth, of those that may be learned from: no test chip.
const PosedImage& nearest_chip(const ClassChips& chips, std::span<const std::size_t> test, const Acquisition& view) {
  const PosedImage* nearest = nullptr;
  double least_rad = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < chips.training.size(); ++n) {
    const double from_view_rad = apart_rad(chips.training[n].acquisition.azimuth_rad, view.azimuth_rad);
    if (from_view_rad >= least_rad || std::ranges::find(test, n) != test.end()) continue;
    least_rad = from_view_rad;
    nearest = &chips.training[n];
  }
  return *nearest;
}

/// The views of an arm that needs no field, from the shots of one class. `test`: those of its training chips that are tested.
std::vector<PosedImage> views_of(Arm arm, const ClassChips& chips, std::span<const PosedImage> shots, std::span<const std::size_t> test,
                                 const Options& o) {
  if (arm == Arm::turned_circle) return turned_through_circle(shots);
  const bool as_shots = arm == Arm::turned || arm == Arm::turned_both || arm == Arm::measured;
  const std::vector<WantedView> wanted = wanted_views(shots, o.generation, as_shots ? std::nullopt : o.generation.depression_deg);
  std::vector<PosedImage> views;
  for (const WantedView& w : wanted) {
    if (arm == Arm::turned || arm == Arm::turned_both || arm == Arm::rescaled) {
      views.push_back(turned(shots[w.nearest], w.acquisition));
      if (arm == Arm::turned_both) views.push_back(turned(shots[w.farther], w.acquisition));
    } else if (arm == Arm::interpolated) {
      views.push_back(interpolated(shots, w.acquisition, o.generation.interpolation));
    } else {
      views.push_back(nearest_chip(chips, test, w.acquisition));
    }
  }
  return views;
}

}  // namespace

std::vector<PosedImage> shots_of(const ClassChips& chips, const std::vector<std::size_t>& which) {
  std::vector<PosedImage> shots;
  for (const std::size_t n : which) shots.push_back(chips.training[n]);
  return shots;
}

void ViewsOfClasses::add(std::vector<PosedImage> of_class, std::size_t c) {
  labels_.insert(labels_.end(), of_class.size(), static_cast<std::int64_t>(c));
  std::ranges::move(of_class, std::back_inserter(views_));
}

LabelledChips ViewsOfClasses::chips() const {
  std::vector<const PosedImage*> pointers;
  for (const PosedImage& view : views_) pointers.push_back(&view);
  return labelled(pointers, labels_);
}

LabelledChips views_of_classes(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& o, const Monitor& monitor) {
  ViewsOfClasses all;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    monitor.check();
    const std::span<const std::size_t> test = tests_training(chips[c], o.validate) ? std::span(draw.test[c]) : std::span<const std::size_t>();
    all.add(views_of(arm, chips[c], shots_of(chips[c], draw.shots[c]), test, o), c);
  }
  return all.chips();
}

}  // namespace sarnerf::app
