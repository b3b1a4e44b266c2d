// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "sarnerf/core/impulse_response.h"
#include "sarnerf/core/units.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/nerf/training_set.h"

/// Images of a block on a textured level ground, drawn without the library's renderers.
namespace sarnerf {

inline const Box& ground_scene_block() {
  static const Box block = [] {
    Box box;
    box.include({-2.0, 0.0, -1.5});
    box.include({2.0, 3.0, 1.5});
    return box;
  }();
  return block;
}

/// Images of it may have been taken through this response.
inline const Resolution kGroundResolution{0.8, 0.8, window_from_text("taylor:-35")};

inline double ground_scene_texture(double x_m, double z_m) {
  return 0.1 * (1.0 + 0.3 * std::sin(0.9 * x_m) * std::cos(0.7 * z_m));
}

/// 48 × 64 pixels of 0.4 m at an incidence of 45°; the ground of view v is `gain(v)` times as bright, and its image is shifted
/// by `shift_m(v)`, along track and in range.
template <class Gain, class Shift>
std::vector<PosedImage> ground_scene(int n_views, Gain&& gain, Shift&& shift_m) {
  const Box& block = ground_scene_block();
  std::vector<PosedImage> images;
  for (int v = 0; v < n_views; ++v) {
    Acquisition a;
    a.azimuth_rad = 2.0 * kPi * v / n_views;
    a.slant_range_m = 8000.0;
    a.n_azimuth = 48;
    a.n_range = 64;
    a.azimuth_spacing_m = a.range_spacing_m = 0.4;
    const glm::dvec2 shift = shift_m(v);
    a.azimuth_shift_m = shift.x;
    a.range_shift_m = shift.y;
    const RadarFrame frame = radar_frame(a);
    const std::vector<double> offset_m = plane_offsets_m(a, 0.0);
    Image<float> power(a.n_azimuth, a.n_range);
    for (int i = 0; i < a.n_azimuth; ++i) {
      for (int j = 0; j < a.n_range; ++j) {
        const glm::dvec3 p =
            a.row_offset_m(i) * frame.h + offset_m[static_cast<std::size_t>(j)] * level_range_direction(a);
        bool shaded = false;
        for (double s = 0.0; s < 6.0; s += 0.05) {
          const glm::dvec3 q = p - s * frame.k;
          shaded |= glm::all(glm::greaterThanEqual(q, block.min)) && glm::all(glm::lessThanEqual(q, block.max));
        }
        power(i, j) = shaded ? 0.0f : static_cast<float>(gain(v) * ground_scene_texture(p.x, p.z));
      }
    }
    const glm::dvec3 size = block.size();
    constexpr int kSteps = 40;
    for (int n = 0; n < kSteps * kSteps * kSteps; ++n) {
      const glm::dvec3 share(n / (kSteps * kSteps), n / kSteps % kSteps, n % kSteps);
      const glm::dvec3 q = block.min + size * share / (kSteps - 1.0);
      // What faces the radar: its front and its top.
      const glm::dvec3 before = q - 0.12 * frame.k;
      if (glm::all(glm::greaterThanEqual(before, block.min)) && glm::all(glm::lessThanEqual(before, block.max)))
        continue;
      const RadarPoint r = project(a, frame, q);
      const auto i = static_cast<int>(std::lround(a.row_of(r.along_track_m)));
      const auto j = static_cast<int>(std::lround(a.bin_of(r.range_offset_m)));
      power(i, j) = 2.0f;
    }
    images.push_back({"view", a, std::move(power)});
  }
  return images;
}

template <class Gain>
std::vector<PosedImage> ground_scene(int n_views, Gain&& gain) {
  return ground_scene(n_views, gain, [](int) { return glm::dvec2(0.0); });
}

/// Gamma speckle of `looks` independent looks.
inline void add_speckle(std::vector<PosedImage>& images, double looks, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::gamma_distribution<double> speckle(looks, 1.0 / looks);
  for (PosedImage& image : images)
    for (float& p : image.power.pixels()) p = static_cast<float>(double{p} * speckle(random));
}

/// Images of ground_scene() under gamma speckle of `looks` independent looks.
inline std::vector<PosedImage> speckled_scene(int n_views, double looks) {
  auto images = ground_scene(n_views, [](int) { return 1.0; });
  add_speckle(images, looks);
  return images;
}

inline Box ground_scene_box() {
  Box box;
  box.include({-18.0, 0.0, -18.0});
  box.include({18.0, 8.0, 18.0});
  return box;
}

inline TrainingSet ground_scene_set(int n_views) {
  return training_set(ground_scene(n_views, [](int) { return 1.0; }), ground_scene_box());
}

}  // namespace sarnerf
