// SPDX-License-Identifier: Apache-2.0
#include "lpips_option.h"

#include <algorithm>

#include "sarnerf/nerf/lpips.h"

namespace sarnerf::app {

ImageDistance load_lpips(const std::filesystem::path& weights) {
  if (weights.empty()) return {};
  return Lpips(weights);
}

std::string lpips_missing(const std::filesystem::path& weights, std::span<const PosedImage> views) {
  if (weights.empty()) return "no weights were given (--lpips FILE, docs/lpips.md)";
  const bool small = std::any_of(views.begin(), views.end(), [](const PosedImage& view) {
    return std::min(view.power.n_azimuth(), view.power.n_range()) < Lpips::kSmallestSide_pixels;
  });
  return small ? "images have sides shorter than the " +
                     std::to_string(Lpips::kSmallestSide_pixels) + " pixels that it needs"
               : "";
}

}  // namespace sarnerf::app
