// SPDX-License-Identifier: Apache-2.0
#include "shining.h"

#include <algorithm>

#include "sarnerf/core/gaussian_blur.h"

namespace sarnerf {
namespace {

constexpr float kShinesFrom = 2.0f, kShines = 4.0f;
constexpr double kBlur_pixels = 1.0;

}  // namespace

Image<float> shining(const Image<float>& power, double ground_power) {
  Image<float> part = gaussian_blur(power, kBlur_pixels);
  for (float& p : part.pixels())
    p = std::clamp((p / static_cast<float>(ground_power) - kShinesFrom) / (kShines - kShinesFrom), 0.0f, 1.0f);
  return part;
}

}  // namespace sarnerf
