// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/numbers.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include "catch.h"

using namespace sarnerf;

namespace {

/// 1, 2, … n, shuffled.
std::vector<double> up_to(int n) {
  std::vector<double> values(static_cast<std::size_t>(n));
  std::iota(values.begin(), values.end(), 1.0);
  std::shuffle(values.begin(), values.end(), std::mt19937(3));
  return values;
}

}  // namespace

TEST_CASE("the value of a rank, in either order, and of a part") {
  for (std::size_t rank = 0; rank < 9; ++rank) {
    CHECK(value_of_rank(up_to(9), rank) == double(rank + 1));
    CHECK(value_of_rank(up_to(9), rank, std::greater<>()) == double(9 - rank));
  }
  std::vector<float> values{5.0f, 1.0f, 9.0f, 0.0f};
  CHECK(value_of_rank(std::span(values).first(3), 1) == 5.0f);
  CHECK(values.back() == 0.0f);
}

TEST_CASE("the median is the upper one of two in the middle, and zero of none") {
  CHECK(median(up_to(7)) == 4.0);
  CHECK(median(up_to(8)) == 5.0);
  CHECK(median(up_to(1)) == 1.0);
  CHECK(median(std::vector<float>{}) == 0.0f);
}

TEST_CASE("quantiles: the smallest value that a share reaches, and the next one below a place") {
  CHECK(quantile_reached(up_to(100), 0.95) == 95.0);
  CHECK(quantile_reached(up_to(10), 0.95) == 10.0);
  CHECK(quantile_reached(up_to(10), 0.5) == 5.0);
  CHECK(quantile_reached(up_to(10), 0.0) == 1.0);
  CHECK(quantile_reached(up_to(10), 1.0) == 10.0);
  CHECK(quantile_below(up_to(10), 0.5) == 5.0);
  CHECK(quantile_below(up_to(11), 0.5) == 6.0);
  CHECK(quantile_below(up_to(11), 0.99) == 10.0);
  CHECK(quantile_below(up_to(11), 1.0) == 11.0);
  CHECK(quantile_below(up_to(1), 0.3) == 1.0);
}

TEST_CASE("round numbers below a value, and their text") {
  const auto text = [](double value) { return round_below(value).text(); };
  CHECK(round_below(1.0).value() == 1.0);
  CHECK(round_below(1.99).value() == 1.0);
  CHECK(round_below(4.9).value() == 2.0);
  CHECK(round_below(99.0).value() == 50.0);
  CHECK(text(1234.0) == "1000");
  CHECK(text(270.0) == "200");
  CHECK(text(0.7) == "0.5");
  CHECK(text(0.051) == "0.05");
  CHECK(text(0.0011) == "0.001");
}

TEST_CASE("round numbers above a value") {
  CHECK(round_above(1.0) == 1.0);
  CHECK(round_above(1.01) == 2.0);
  CHECK(round_above(0.03) == Approx(0.05));
  CHECK(round_above(7.0) == 10.0);
  CHECK(round_above(0.002) == Approx(0.002));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double none : {0.0, -1.0, double(NAN), kInfinity}) CHECK(round_above(none) == 1.0);
}

TEST_CASE("multiples of powers of ten written out") {
  CHECK(decimal_text(25, 1) == "250");
  CHECK(decimal_text(25, -3) == "0.025");
  CHECK(decimal_text(25, -1) == "2.5");
  CHECK(decimal_text(0, 4) == "0");
}

TEST_CASE("the top of a parabola through three values") {
  for (const double top : {-0.4, 0.0, 0.3}) {
    const auto parabola = [&](double x) { return 2.0 - 3.0 * (x - top) * (x - top); };
    CHECK(top_of_parabola(parabola(-1.0), parabola(0.0), parabola(1.0)) == Approx(top).margin(1e-12));
  }
  CHECK(top_of_parabola(1.0, 1.0, 1.0) == 0.0);
  CHECK(top_of_parabola(0.0, 1.0, 1.0) == Approx(0.5));
}

TEST_CASE("indices are spread evenly") {
  using Indices = std::vector<std::size_t>;
  CHECK(spread_indices(9, 3) == Indices{1, 4, 7});
  CHECK(spread_indices(8, 3) == Indices{1, 4, 6});
  CHECK(spread_indices(3, 5) == Indices{0, 1, 2});
  CHECK(spread_indices(0, 2).empty());
}
