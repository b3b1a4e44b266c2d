// SPDX-License-Identifier: Apache-2.0
// Which pixels show the bare ground, and which the cores of shadows.
#include <cmath>

#include "ground_steps.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"

namespace sarnerf::ground {

std::vector<double> block_means(const Image<float>& power, int side) {
  std::vector<double> means;
  for (int i = 0; i + side <= power.n_azimuth(); i += side)
    for (int j = 0; j + side <= power.n_range(); j += side) {
      double sum = 0.0;
      for (int n = 0; n < side * side; ++n) sum += double{power(i + n / side, j + n % side)};
      means.push_back(sum / (side * side));
    }
  return means;
}

namespace {

/// Brightness of each pixel's neighbourhood over that of the expected ground.
Image<float> brightness_around(const Image<float>& power, const Image<float>& expected, const GroundRule& rule) {
  Image<float> ratio(power.n_azimuth(), power.n_range());
  for (std::size_t n = 0; n < ratio.pixels().size(); ++n) {
    const float e = expected.pixels()[n];
    ratio.pixels()[n] = e > 0.0f ? power.pixels()[n] / e : 0.0f;
  }
  return gaussian_blur(ratio, rule.mask_sigma_pixels);
}

}  // namespace

Mask ground_mask(const Image<float>& power, const Image<float>& expected, const GroundRule& rule) {
  const Image<float> around = brightness_around(power, expected, rule);
  Mask mask(power.n_azimuth(), power.n_range());
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    const double a = double{around.pixels()[n]};
    mask.pixels()[n] = a * rule.mask_factor > 1.0 && a < rule.mask_factor ? 1 : 0;
  }
  if (rule.object_reach_pixels > 0) {
    for (std::uint8_t& pixel : mask.pixels()) pixel = 1 - pixel;
    mask = connected_to_middle(mask, rule.object_reach_pixels);
    for (std::uint8_t& pixel : mask.pixels()) pixel = 1 - pixel;
  }
  return mask;
}

double masked_sum(const Image<float>& image, const Mask& mask) {
  double sum = 0.0;
  for (std::size_t n = 0; n < mask.pixels().size(); ++n)
    if (mask.pixels()[n] != 0) sum += double{image.pixels()[n]};
  return sum;
}

double masked_pixels(const Mask& mask) {
  double n = 0.0;
  for (const std::uint8_t m : mask.pixels()) n += m;
  return n;
}

double noise_of_shadows(Views images, const LevelGround& plane, std::span<const Mask> masks, const GroundRule& rule) {
  const int reach = static_cast<int>(std::ceil(2.0 * rule.mask_sigma_pixels));
  std::vector<Mask> core(images.size());
  for_each_view(images, [&](std::size_t v) {
    const Image<float> around = brightness_around(images[v].power, ground_image(plane, images[v].acquisition), rule);
    Image<float> lit(around.n_azimuth(), around.n_range());
    for (std::size_t p = 0; p < lit.pixels().size(); ++p)
      lit.pixels()[p] = masks[v].pixels()[p] == 0 && double{around.pixels()[p]} * rule.mask_factor <= 1.0 ? 0.0f : 1.0f;
    const Mask near_lit = target_mask(lit, {.share_of_peak = 0.0, .dilation_pixels = reach});
    core[v] = Mask(lit.n_azimuth(), lit.n_range());
    for (int i = reach; i < lit.n_azimuth() - reach; ++i)  // what lies beyond the border is not known
      for (int j = reach; j < lit.n_range() - reach; ++j) core[v](i, j) = 1 - near_lit(i, j);
  });
  double sum = 0.0, n_pixels = 0.0;
  for (std::size_t v = 0; v < images.size(); ++v) {
    sum += masked_sum(images[v].power, core[v]);
    n_pixels += masked_pixels(core[v]);
  }
  return n_pixels < rule.block_pixels * rule.block_pixels ? 0.0 : sum / n_pixels;
}

UniformGround uniform_ground(Views images, const GroundRule& rule) {
  UniformGround ground{std::vector<double>(images.size()), std::vector<Mask>(images.size())};
  for_each_view(images, [&](std::size_t v) {
    const Image<float>& power = images[v].power;
    ground.gain[v] = median(block_means(power, rule.block_pixels));
    const Image<float> expected(power.n_azimuth(), power.n_range(), static_cast<float>(ground.gain[v]));
    ground.mask[v] = ground_mask(power, expected, rule);
  });
  return ground;
}

}  // namespace sarnerf::ground
