// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sarnerf {

/// Heights of a line of text as shares of its size: from the baseline up and down, between lines, and
/// the height of capitals and digits, by whose middle a line is centred.
inline constexpr double kAscent = 0.80;
inline constexpr double kDescent = 0.24;
inline constexpr double kLineHeight = 1.3;
inline constexpr double kCapHeight = 0.73;

/// The text as valid UTF-8 of characters that XML allows: others become U+FFFD, white space a space.
std::string clean_text(std::string_view text);

/// Upper bound of the width (pixels) of a clean text of ordinary characters at `size_px` in DejaVu Sans, the
/// widest of the fonts that plots name. Exact for ASCII in regular weight but for kerning.
double text_width_px(std::string_view clean, double size_px, bool bold = false);

/// A clean text in lines of at most `width_px`, broken at spaces and, where a word alone is too long, within
/// it; at most `max_lines`, the last ending in "…" where text was left out. No lines for an empty text.
std::vector<std::string> wrap_text(std::string_view clean, double size_px, double width_px,
                                   std::size_t max_lines, bool bold = false);

}  // namespace sarnerf
