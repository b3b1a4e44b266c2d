// SPDX-License-Identifier: Apache-2.0
#include <random>
#include <string>

#include "catch.h"
#include "svg_document.h"
#include "svg.h"

using namespace sarnerf;

TEST_CASE("widths of texts are those of the font for ASCII, and never less") {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> character(0x20, 0x7E), length(1, 60);
  for (int n = 0; n < 200; ++n) {
    std::string text;
    for (int left = length(random); left > 0; --left) text += char(character(random));
    const double drawn = drawn_width_px(text, 16.0, false);
    CAPTURE(text);
    CHECK(text_width_px(text, 16.0) == Approx(drawn).epsilon(1e-6));
    CHECK(text_width_px(text, 16.0, true) >= drawn_width_px(text, 16.0, true));
    CHECK(text_width_px(text, 32.0) == Approx(2.0 * text_width_px(text, 16.0)));
  }
  for (const char* text : {"10⁻³ 2.5·10⁷", "−0.5", "512 × 512", "45°", "β⁰ σ⁰ γ⁰ θ φ Ω Δ", "µs",
                           "é à ü Å Œ ß", "Резкость Щ", "– — …", "≤ ≥ ≈ → ‖ √ ∞", "中文"}) {
    CAPTURE(text);
    CHECK(text_width_px(text, 16.0) >= drawn_width_px(text, 16.0, false));
    CHECK(text_width_px(text, 16.0, true) >= drawn_width_px(text, 16.0, true));
  }
}

TEST_CASE("wrapped lines fit and lose no word") {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> letter('a', 'z'), length(1, 12), words(0, 40);
  std::uniform_real_distribution<double> width(120.0, 500.0);
  for (int n = 0; n < 300; ++n) {
    std::string text;
    for (int word = words(random); word > 0; --word) {
      for (int left = length(random); left > 0; --left) text += char(letter(random));
      text += word > 1 ? " " : "";
    }
    const double width_px = width(random);
    std::string rejoined;
    for (const std::string& line : wrap_text(text, 16.0, width_px, 1000)) {
      CHECK(text_width_px(line, 16.0) <= width_px);
      rejoined += (rejoined.empty() ? "" : " ") + line;
    }
    // Twelve letters may be wider than the narrowest line; words that are must break.
    if (width_px > 12 * 16.0) CHECK(rejoined == text);

    const auto three = wrap_text(text, 16.0, width_px, 3);
    const bool cut = wrap_text(text, 16.0, width_px, 1000).size() > 3;
    CHECK(three.size() <= 3);
    for (const std::string& line : three) CHECK(text_width_px(line, 16.0) <= width_px);
    if (!three.empty()) CHECK((three.back().find("…") != std::string::npos) == cut);
  }
}

TEST_CASE("a word that is too long breaks, between characters") {
  std::string word;
  for (int n = 0; n < 50; ++n) word += "é";
  std::string rejoined;
  const auto lines = wrap_text(word, 16.0, 100.0, 100);
  CHECK(lines.size() > 1);
  for (const std::string& line : lines) {
    CHECK(clean_text(line) == line);
    rejoined += line;
  }
  CHECK(rejoined == word);
}

TEST_CASE("what is not UTF-8 or not allowed in XML becomes U+FFFD") {
  const std::string bad = "\xEF\xBF\xBD";
  CHECK(clean_text("σ⁰ 中 𝛽") == "σ⁰ 中 𝛽");
  CHECK(clean_text("a\tb\nc") == "a b c");
  CHECK(clean_text(std::string("a\0b", 3)) == "a" + bad + "b");
  CHECK(clean_text("\x1B[1m") == bad + "[1m");
  CHECK(clean_text("\xFF") == bad);
  CHECK(clean_text("end\xC3") == "end" + bad);                     // cut short
  CHECK(clean_text("\xC0\xAF") == bad + bad);                      // longer than needed
  CHECK(clean_text("\xED\xA0\x80") == bad + bad + bad);            // half of a surrogate pair
  CHECK(clean_text("\xEF\xBF\xBE") == bad);                        // U+FFFE
  CHECK(clean_text("\xF4\x90\x80\x80") == bad + bad + bad + bad);  // beyond Unicode
}
