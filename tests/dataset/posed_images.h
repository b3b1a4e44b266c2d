// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "sarnerf/core/units.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf::test {

/// 40 × 48 pixels of 0.5 m and 0.4 m, seen from 2 km.
inline Acquisition seen_from(double azimuth_deg, double incidence_deg = 45.0) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(azimuth_deg);
  a.incidence_rad = rad_from_deg(incidence_deg);
  a.slant_range_m = 2000.0;
  a.aim_m = {5e5, 30.0, -4e6};
  a.n_azimuth = 40;
  a.n_range = 48;
  a.azimuth_spacing_m = 0.5;
  a.range_spacing_m = 0.4;
  return a;
}

inline PosedImage flat(const Acquisition& a, float value, std::string name = "flat") {
  return {std::move(name), a, Image<float>(a.n_azimuth, a.n_range, value)};
}

/// Nothing in common between two pixels, nor between two seeds.
inline PosedImage noise(const Acquisition& a, unsigned seed) {
  PosedImage image = flat(a, 0.0f, "noise" + std::to_string(seed));
  std::mt19937 random(seed);
  std::exponential_distribution<float> power(1.0f);
  for (float& p : image.power.pixels()) p = power(random);
  return image;
}

/// A smooth bright spot at a world point, 1.2 m wide (σ), where project() puts it.
inline PosedImage spot(const Acquisition& a, const glm::dvec3& world_m, double peak = 1.0) {
  PosedImage image = flat(a, 0.0f, "spot");
  const RadarPoint p = project(a, radar_frame(a), world_m);
  for (int i = 0; i < a.n_azimuth; ++i) {
    for (int j = 0; j < a.n_range; ++j) {
      const double da = a.row_offset_m(i) - p.along_track_m,
                   ds = a.bin_offset_m(j) - p.range_offset_m;
      image.power(i, j) =
          static_cast<float>(peak * std::exp(-0.5 * (da * da + ds * ds) / (1.2 * 1.2)));
    }
  }
  return image;
}

/// Centre of brightness: along track and in range, relative to the aim point (m).
inline glm::dvec2 centroid_m(const Acquisition& a, const Image<float>& power) {
  glm::dvec2 sum{0.0};
  double weight = 0.0;
  for (int i = 0; i < a.n_azimuth; ++i) {
    for (int j = 0; j < a.n_range; ++j) {
      sum += double(power(i, j)) * glm::dvec2(a.row_offset_m(i), a.bin_offset_m(j));
      weight += double(power(i, j));
    }
  }
  return sum / weight;
}

inline bool same_pixels(const Image<float>& a, const Image<float>& b) {
  return a.n_azimuth() == b.n_azimuth() && a.n_range() == b.n_range() &&
         std::equal(a.pixels().begin(), a.pixels().end(), b.pixels().begin());
}

}  // namespace sarnerf::test
