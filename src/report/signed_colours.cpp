// SPDX-License-Identifier: Apache-2.0
#include "signed_colours.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sarnerf {
namespace {

/// From zero to the limit in equal steps.
constexpr std::array<Colour, 3> kBelow{{{245, 245, 245}, {86, 180, 233}, {10, 72, 150}}};
constexpr std::array<Colour, 3> kAbove{{{245, 245, 245}, {230, 159, 0}, {148, 40, 0}}};

Colour between(const std::array<Colour, 3>& anchors, float share) {
  const float place = 2.0f * share;
  const std::size_t from = place < 1.0f ? 0 : 1;
  const float weight = place - static_cast<float>(from);
  Colour colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const float value = (1.0f - weight) * anchors[from][c] + weight * anchors[from + 1][c];
    colour[c] = static_cast<std::uint8_t>(std::lround(value));
  }
  return colour;
}

}  // namespace

Image<Colour> signed_colours(const Image<float>& values, float limit) {
  Image<Colour> picture(values.n_azimuth(), values.n_range());
  for (std::size_t n = 0; n < picture.pixels().size(); ++n) {
    const float v = values.pixels()[n];
    if (!std::isfinite(v)) continue;
    const float share = limit > 0.0f ? std::min(std::abs(v) / limit, 1.0f) : 0.0f;
    picture.pixels()[n] = between(v < 0.0f ? kBelow : kAbove, share);
  }
  return picture;
}

}  // namespace sarnerf
