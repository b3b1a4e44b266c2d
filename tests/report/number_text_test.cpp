// SPDX-License-Identifier: Apache-2.0
#include "training_parts.h"

#include <cmath>
#include <limits>

#include "svg.h"
#include "catch.h"

using namespace sarnerf;

namespace {

std::string coded(const std::string& text) {
  return base64(std::as_bytes(std::span(text.data(), text.size())));
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Relative luminance of an sRGB colour (IEC 61966-2-1), 0 to 1.
double luminance(const Colour& colour) {
  const double weights[]{0.2126, 0.7152, 0.0722};
  double sum = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = colour[c] / 255.0;
    sum += weights[c] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return sum;
}

}  // namespace

TEST_CASE("numbers read the same everywhere") {
  CHECK(decimal(48.205, 1) == "48.2");
  CHECK(decimal(-3.2, 2) == "−3.20");
  CHECK(decimal(-0.001, 2) == "0.00");
  CHECK(decimal(1e300, 0).size() == 301);
  CHECK(decimal(kInfinity, 2) == "∞");
  CHECK(decimal(-kInfinity, 2) == "−∞");
  CHECK(decimal(std::nan(""), 2) == "–");
  CHECK(decimal(std::optional<double>{}, 2) == "–");
  CHECK(signed_decimal(5.61, 1) == "+5.6");
  CHECK(signed_decimal(-5.61, 1) == "−5.6");
  CHECK(signed_decimal(0.01, 1) == "0.0");
  CHECK(signed_decimal(kInfinity, 1) == "+∞");
  CHECK(significant(0.05, 3) == "0.05");
  CHECK(significant(1234.0, 4) == "1234");
  CHECK(degrees(45.0) == "45°");
  CHECK(degrees(12.5) == "12.5°");
  CHECK(degrees(350.0) == "350°");
  CHECK(count(1, "view") == "1 view");
  CHECK(count(0, "view") == "0 views");
}

TEST_CASE("times in units that people grasp, without a 60 where the next unit begins") {
  CHECK(duration(0.0) == "0.00 s");
  CHECK(duration(0.834) == "0.83 s");
  CHECK(duration(9.999) == "10.0 s");
  CHECK(duration(12.44) == "12.4 s");
  CHECK(duration(59.97) == "1 min 00 s");
  CHECK(duration(200.0) == "3 min 20 s");
  CHECK(duration(3599.7) == "1 h 00 min");
  CHECK(duration(3900.0) == "1 h 05 min");
  CHECK(duration(7199.0) == "2 h 00 min");
  CHECK(duration(1e20) == "1e+20 s");
}

TEST_CASE("base64 as RFC 4648 has it, and every byte") {
  CHECK(coded("").empty());
  CHECK(coded("f") == "Zg==");
  CHECK(coded("fo") == "Zm8=");
  CHECK(coded("foo") == "Zm9v");
  CHECK(coded("foob") == "Zm9vYg==");
  CHECK(coded("fooba") == "Zm9vYmE=");
  CHECK(coded("foobar") == "Zm9vYmFy");
  CHECK(coded("\xFB\xEF\xFF") == "++//");
}

TEST_CASE("signed colours: grey at zero, equally dark on both sides, blue below and orange above") {
  Image<float> values(1, 203);
  for (int n = 0; n < 201; ++n) values(0, n) = 0.05f * float(n - 100);  // limit 4, clamped beyond
  values(0, 201) = NAN;
  values(0, 202) = INFINITY;
  const Image<Colour> colours = signed_colours(values, 4.0f);
  CHECK(colours(0, 100) == Colour{245, 245, 245});
  CHECK(colours(0, 201) == Colour{0, 0, 0});
  CHECK(colours(0, 202) == Colour{0, 0, 0});
  for (int n = 1; n <= 100; ++n) {
    CAPTURE(n);
    const Colour below = colours(0, 100 - n), above = colours(0, 100 + n);
    if (n > 80) {
      CHECK(below == colours(0, 20));
      CHECK(above == colours(0, 180));
      continue;
    }
    CHECK(below[2] > below[0]);
    CHECK(above[0] > above[2]);
    CHECK(luminance(below) < luminance(colours(0, 101 - n)));
    CHECK(luminance(above) < luminance(colours(0, 99 + n)));
    CHECK(luminance(below) == Approx(luminance(above)).margin(0.06));
  }
  CHECK(signed_colours(values, 0.0f)(0, 0) == Colour{245, 245, 245});
}
