// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/target_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "same_size.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

using Mask = Image<std::uint8_t>;

/// Dilates one line of n pixels, `stride` apart, by `reach` to both sides: each pixel asks how far away the
/// last and the next one of the target are.
void dilate_line(std::uint8_t* first, int n, std::ptrdiff_t stride, int reach) {
  // 2 marks what was added, so that it does not spread any further.
  for (const bool forwards : {true, false}) {
    int since = std::numeric_limits<int>::max();
    for (int m = 0; m < n; ++m) {
      std::uint8_t& pixel = first[stride * (forwards ? m : n - 1 - m)];
      if (pixel == 1) {
        since = 0;
      } else if (since < reach) {
        ++since;
        pixel = 2;
      } else {
        since = std::numeric_limits<int>::max();
      }
    }
  }
  for (int m = 0; m < n; ++m) first[stride * m] = first[stride * m] != 0;
}

}  // namespace

Mask target_mask(const Image<float>& reference, const TargetRule& rule) {
  if (!(rule.share_of_peak >= 0.0 && rule.share_of_peak < 1.0)) {
    throw UsageError("the target's share of the peak lies in [0, 1); it is " +
                     std::to_string(rule.share_of_peak));
  }
  if (rule.dilation_pixels < 0) {
    throw UsageError("a target cannot be dilated by " + std::to_string(rule.dilation_pixels) +
                     " pixels; 0 leaves it as it is");
  }
  float peak = 0.0f;
  for (const float p : reference.pixels()) peak = std::max(peak, p);
  const double floor = double(peak) * rule.share_of_peak;

  Mask mask(reference.n_azimuth(), reference.n_range());
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    mask.pixels()[n] = double(reference.pixels()[n]) > floor;
  }
  if (mask.pixels().empty()) return mask;
  for (int i = 0; i < mask.n_azimuth(); ++i) {
    dilate_line(&mask(i, 0), mask.n_range(), 1, rule.dilation_pixels);
  }
  for (int j = 0; j < mask.n_range(); ++j) {
    dilate_line(&mask(0, j), mask.n_azimuth(), mask.n_range(), rule.dilation_pixels);
  }
  return mask;
}

std::optional<double> masked_psnr_db(const Image<float>& image, const Image<float>& reference,
                                     double peak, const Mask& mask) {
  require_same_size(image, reference);
  require_same_size(mask, reference);
  if (!(peak > 0.0)) {
    throw UsageError("the peak of a PSNR must be positive; it is " + std::to_string(peak));
  }
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    if (mask.pixels()[n] == 0) continue;
    const double d = double(image.pixels()[n]) - double(reference.pixels()[n]);
    sum += d * d;
    ++count;
  }
  if (count == 0) return std::nullopt;
  if (sum == 0.0) return std::numeric_limits<double>::infinity();
  return 10.0 * std::log10(peak * peak * double(count) / sum);
}

}  // namespace sarnerf
