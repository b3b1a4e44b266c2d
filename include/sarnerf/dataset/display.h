// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/calibration.h"

namespace sarnerf {

/// How a display picture maps brightness to grey.
struct DisplayRange {
  double range_db = 40.0;     ///< from white down to black
  double percentile = 99.9;   ///< of the pixels above zero: white. A few glints do not darken the rest
};

/// The value shown white: the percentile of the image's positive pixels; 0 for a blank image. O(pixels).
float white_level(const Image<float>& image, const DisplayRange& range = {});

/// A level in decibels: 10 log₁₀ of a power, 20 log₁₀ of an amplitude.
double level_db(float level, Quantity quantity);

/// Grey levels of an image in decibels: white at `white` and above, black at `range_db` below it and for
/// everything that is not positive. A blank image is black. The picture is for the eye; figures belong to
/// the TIFF. Rows and columns stay where they are: row 0 on top, near range on the left. Pictures that are
/// to be compared share one white level.
Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity, float white,
                                   const DisplayRange& range = {});

/// The same with the image's own white level.
Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity,
                                   const DisplayRange& range = {});

/// The bytes of an 8-bit grey PNG, compressed fast rather than tightly: a sweep writes hundreds.
std::vector<std::byte> encode_png(const Image<std::uint8_t>& levels);

}  // namespace sarnerf
