// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/manifest.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

Acquisition acquisition_of(const DatasetView& view, const glm::dvec3& aim_m) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(view.azimuth_deg);
  a.incidence_rad = rad_from_deg(view.incidence_deg);
  a.slant_range_m = view.slant_range_m;
  a.aim_m = aim_m;
  a.look = view.look;
  a.n_azimuth = view.n_azimuth;
  a.n_range = view.n_range;
  a.azimuth_spacing_m = view.azimuth_spacing_m;
  a.range_spacing_m = view.range_spacing_m;
  return a;
}

std::string unfinished_text(const Dataset& dataset) {
  if (!dataset.unfinished()) return "";
  return std::to_string(dataset.views.size()) + " of " + std::to_string(dataset.n_planned_views) +
         " views: what makes them was interrupted; the same command makes the rest";
}

Box scene_box_of_swath(const glm::dvec3& aim_m, std::span<const DatasetView> views) {
  if (views.empty()) throw UsageError("a dataset needs at least one view");
  double half_m = 0.0, height_m = 0.0;
  for (const DatasetView& view : views) {
    const double incidence_rad = rad_from_deg(view.incidence_deg);
    const double swath_m = view.n_range * view.range_spacing_m;
    const double ground_m = swath_m / std::sin(incidence_rad);
    half_m = std::max(half_m, 0.5 * std::hypot(view.n_azimuth * view.azimuth_spacing_m, ground_m));
    height_m = std::max(height_m, 0.5 * swath_m / std::cos(incidence_rad));
  }
  return {aim_m - glm::dvec3(half_m, 0.0, half_m), aim_m + glm::dvec3(half_m, height_m, half_m)};
}

}  // namespace sarnerf
