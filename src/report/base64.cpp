// SPDX-License-Identifier: Apache-2.0
#include "base64.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace sarnerf {

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    const std::size_t here = std::min<std::size_t>(3, bytes.size() - n);
    std::uint32_t bits = 0;
    for (std::size_t b = 0; b < 3; ++b) {
      bits = bits << 8 | (b < here ? std::to_integer<std::uint32_t>(bytes[n + b]) : 0u);
    }
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += digit <= here ? kDigits[bits >> (18 - 6 * digit) & 63u] : '=';
    }
  }
  return text;
}

}  // namespace sarnerf
