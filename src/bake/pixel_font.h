// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/colour_picture.h"

namespace sarnerf {

/// A letter is 5 × 7 dots, and 6 dots from the next.
inline constexpr int kLetterHeight = 7, kLetterPitch = 6;

/// Writes the letters, digits and full stops that previews need, each dot `scale` pixels square, with the first one's
/// upper left corner at (line, column); other characters are blanks. What lies beyond the picture is left out.
void draw_text(Image<Colour>& picture, int line, int column, std::string_view text, int scale, const Colour& colour);

}  // namespace sarnerf
