// SPDX-License-Identifier: Apache-2.0
// Four words and a few numbers: a font of dots spares the extraction the libraries that draw text.
#include "pixel_font.h"

#include <algorithm>
#include <array>
#include <iterator>

namespace sarnerf {
namespace {

struct Letter {
  char character;
  std::array<std::string_view, kLetterHeight> lines;
};

// clang-format off
constexpr Letter kLetters[] = {
    {'0', {" ### ", "#   #", "#   #", "#   #", "#   #", "#   #", " ### "}},
    {'1', {"  #  ", " ##  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'2', {" ### ", "#   #", "    #", "   # ", "  #  ", " #   ", "#####"}},
    {'5', {"#####", "#    ", "#### ", "    #", "    #", "#   #", " ### "}},
    {'.', {"     ", "     ", "     ", "     ", "     ", " ##  ", " ##  "}},
    {'a', {"     ", "     ", " ### ", "    #", " ####", "#   #", " ####"}},
    {'b', {"#    ", "#    ", "#### ", "#   #", "#   #", "#   #", "#### "}},
    {'d', {"    #", "    #", " ####", "#   #", "#   #", "#   #", " ####"}},
    {'e', {"     ", "     ", " ### ", "#   #", "#####", "#    ", " ### "}},
    {'f', {"  ## ", " #   ", "#### ", " #   ", " #   ", " #   ", " #   "}},
    {'i', {"  #  ", "     ", " ##  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'l', {" ##  ", "  #  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'m', {"     ", "     ", "## # ", "# # #", "# # #", "# # #", "# # #"}},
    {'n', {"     ", "     ", "#### ", "#   #", "#   #", "#   #", "#   #"}},
    {'o', {"     ", "     ", " ### ", "#   #", "#   #", "#   #", " ### "}},
    {'q', {"     ", " ####", "#   #", "#   #", " ####", "    #", "    #"}},
    {'r', {"     ", "     ", "# ## ", "##   ", "#    ", "#    ", "#    "}},
    {'s', {"     ", "     ", " ####", "#    ", " ### ", "    #", "#### "}},
    {'t', {" #   ", " #   ", "#### ", " #   ", " #   ", " #   ", "  ## "}},
    {'u', {"     ", "     ", "#   #", "#   #", "#   #", "#  ##", " ## #"}},
    {'v', {"     ", "     ", "#   #", "#   #", "#   #", " # # ", "  #  "}},
    {'X', {"#   #", "#   #", " # # ", "  #  ", " # # ", "#   #", "#   #"}},
    {'Y', {"#   #", "#   #", " # # ", "  #  ", "  #  ", "  #  ", "  #  "}},
    {'Z', {"#####", "    #", "   # ", "  #  ", " #   ", "#    ", "#####"}},
};
// clang-format on

}  // namespace

void draw_text(Image<Colour>& picture, int line, int column, std::string_view text, int scale, const Colour& colour) {
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto letter = std::find_if(std::begin(kLetters), std::end(kLetters),
                                     [&](const Letter& l) { return l.character == text[n]; });
    if (letter == std::end(kLetters)) continue;
    const int left = column + static_cast<int>(n) * kLetterPitch * scale;
    for (int i = 0; i < kLetterHeight * scale; ++i) {
      const std::string_view dots = letter->lines[static_cast<std::size_t>(i / scale)];
      for (int j = 0; j < static_cast<int>(dots.size()) * scale; ++j) {
        const int at_line = line + i, at_column = left + j;
        const bool inside =
            at_line >= 0 && at_line < picture.n_azimuth() && at_column >= 0 && at_column < picture.n_range();
        if (inside && dots[static_cast<std::size_t>(j / scale)] == '#') picture(at_line, at_column) = colour;
      }
    }
  }
}

}  // namespace sarnerf
