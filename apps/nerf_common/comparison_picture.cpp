// SPDX-License-Identifier: Apache-2.0
#include "comparison_picture.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/dataset/colour_picture.h"
#include "sarnerf/dataset/display.h"

namespace sarnerf::app {
namespace {

constexpr int kGap = 2;
constexpr double kFullColour = 0.25;  ///< of the peak

Colour grey(std::uint8_t level) { return {level, level, level}; }

Colour signed_colour(double share) {
  constexpr double kNeutral = 128.0;
  const double s = std::clamp(share, -1.0, 1.0);
  const auto toward = [&](double full) {
    return static_cast<std::uint8_t>(std::lround(kNeutral + std::abs(s) * (full - kNeutral)));
  };
  return s >= 0.0 ? Colour{toward(255.0), toward(40.0), toward(40.0)}
                  : Colour{toward(40.0), toward(90.0), toward(255.0)};
}

}  // namespace

std::vector<std::byte> comparison_picture(std::span<const Image<float>* const> images, const Image<float>& truth,
                                          const Image<float>& prediction, float white, float peak) {
  const int n_azimuth = truth.n_azimuth(), n_range = truth.n_range();
  const int n_images = static_cast<int>(images.size());
  Image<Colour> picture(n_azimuth, (n_images + 1) * n_range + n_images * kGap, grey(255));
  int left = 0;
  for (const Image<float>* image : images) {
    const auto levels = display_levels(*image, Quantity::power, white);
    for (int i = 0; i < n_azimuth; ++i)
      for (int j = 0; j < n_range; ++j) picture(i, left + j) = grey(levels(i, j));
    left += n_range + kGap;
  }
  for (int i = 0; i < n_azimuth; ++i)
    for (int j = 0; j < n_range; ++j)
      picture(i, left + j) =
          signed_colour((double{prediction(i, j)} - double{truth(i, j)}) / (kFullColour * double{peak}));
  return encode_png(picture);
}

}  // namespace sarnerf::app
