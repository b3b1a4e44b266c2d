// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/view_interpolation.h"

#include <algorithm>
#include <cmath>

#include "interpolate_between.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
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
                                 double plane_height_m, Average average) {
  return weighted_mean(neighbours_of(training, wanted, method), wanted, warp_of(method),
                       plane_height_m, average);
}

Image<float> weighted_mean(std::span<const Neighbour> neighbours, const Acquisition& wanted,
                           Warp warp, double plane_height_m, Average average) {
  std::vector<WarpedView> views;
  for (const Neighbour& n : neighbours) views.emplace_back(*n.view, wanted, warp, plane_height_m);

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
                              Interpolation method, double plane_height_m) {
  validate(wanted);
  return interpolate_between(checked_views(training), wanted, method, plane_height_m);
}

}  // namespace sarnerf
