// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "recipe_file.h"
#include "sarnerf/core/image.h"
#include "sarnerf/dataset/calibration.h"

namespace sarnerf::app {

/// The white level that display pictures share, so that a sweep's pictures can be compared and do not flicker
/// as an animation: the median of the white levels of a few views spread over the sweep. A wall that flashes
/// in one view then does not darken the others, and the choice depends on the recipe alone, not on which views
/// were finished before an interruption.
class DisplayScale {
 public:
  /// The views whose white levels the scale of a sweep is made of: at most nine.
  static std::vector<std::size_t> sample_views(std::size_t n_views);

  /// From the white levels of those views (white_level()); blank ones are passed over. When all are, each
  /// picture gets a level of its own.
  explicit DisplayScale(std::span<const float> white_levels);

  float white_for(const Image<float>& image) const;

  /// What black and white stand for, for recipes and manifests.
  Json text(Quantity quantity) const;

 private:
  std::optional<float> white_;
};

/// The display picture (PNG) of an image, for the eye.
std::vector<std::byte> make_picture(const Image<float>& image, Quantity quantity, const DisplayScale& scale);

}  // namespace sarnerf::app
