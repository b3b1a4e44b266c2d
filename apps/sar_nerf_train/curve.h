// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/learned_field.h"

namespace sarnerf::app {

/// PSNR of a few held-out views while training goes on, taken so seldom that it costs at most a tenth of the time.
class Curve {
 public:
  /// Up to eight of the views, evenly spread; none where there are none. `validation` must outlive the curve.
  Curve(std::span<const PosedImage> validation, double peak_power);

  /// Mean PSNR of power over the curve's views (dB), if it is time for it at `now_s`.
  std::optional<double> measure_if_due(const LearnedField& field, double now_s);

  /// The same at once.
  double measure(const LearnedField& field);

  /// The last one; none yet.
  std::optional<double> last_db() const { return last_db_; }
  std::span<const std::size_t> views() const { return views_; }
  double spent_s() const { return spent_s_; }

 private:
  std::span<const PosedImage> validation_;
  std::vector<std::size_t> views_;
  double peak_power_;
  std::optional<double> first_s_, last_db_;
  double next_s_ = 0.0, spent_s_ = 0.0;
};

}  // namespace sarnerf::app
