// SPDX-License-Identifier: Apache-2.0
#include "plot_layout.h"

#include <cmath>
#include <cstdlib>
#include <random>
#include <set>

#include "catch.h"

using namespace sarnerf;

namespace {

std::vector<Tick> labelled(const std::vector<Tick>& ticks) {
  std::vector<Tick> found;
  for (const Tick& tick : ticks) {
    if (!tick.label.empty()) found.push_back(tick);
  }
  return found;
}

std::vector<double> minor(const std::vector<Tick>& ticks) {
  std::vector<double> found;
  for (const Tick& tick : ticks) {
    if (tick.label.empty()) found.push_back(tick.value);
  }
  return found;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

/// What a reader takes a label for.
double meaning(std::string label) {
  const std::string superscripts[]{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const bool power = label.find("10⁻") != std::string::npos || [&] {
    for (const auto& s : superscripts) {
      if (label.find(s) != std::string::npos) return true;
    }
    return false;
  }();
  if (power) {
    label = replaced(label, "·10", "e");
    if (label.find('e') == std::string::npos) label = replaced(label, "10", "1e");
    for (int n = 0; n < 10; ++n) label = replaced(label, superscripts[n], std::to_string(n));
    label = replaced(label, "⁻", "-");
  }
  label = replaced(label, "−", "-");
  char* end = nullptr;
  const double value = std::strtod(label.c_str(), &end);
  return *end == '\0' ? value : NAN;
}

void check_labels(const std::vector<Tick>& ticks, double low, double high, int most) {
  const auto shown = labelled(ticks);
  CAPTURE(low, high, most, shown.size());
  CHECK(shown.size() <= std::size_t(most));
  if (most == kMostLabels) CHECK(shown.size() >= 3);
  std::set<std::string> texts;
  for (const Tick& tick : shown) {
    texts.insert(tick.label);
    CAPTURE(tick.label, tick.value);
    CHECK(std::abs(meaning(tick.label) - tick.value) <= 1e-12 * std::abs(tick.value));
  }
  CHECK(texts.size() == shown.size());
  const double slack = 1e-9 * std::max(std::abs(low), std::abs(high));
  for (std::size_t n = 0; n < ticks.size(); ++n) {
    CHECK((ticks[n].value >= low - slack && ticks[n].value <= high + slack));
    if (n > 0) CHECK(ticks[n].value > ticks[n - 1].value);
  }
}

/// m and e of value = m × 10^e with 1 ≤ m < 10.
double mantissa(double value) {
  const double m = value / std::pow(10.0, std::floor(std::log10(value) + 1e-9));
  return std::round(m * 1e6) / 1e6;
}

}  // namespace

TEST_CASE("linear ticks: three to eight, 1, 2 or 5 apart, none missing") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-20.0, 20.0), unit(-1.0, 1.0);
  for (int n = 0; n < 3000; ++n) {
    const double span = std::pow(10.0, exponent(random));
    // From ranges around zero to those that are a millionth of their distance from it.
    const double offset =
        unit(random) * span * std::pow(10.0, std::max(0.0, exponent(random)) * 0.29);
    const double low = offset, high = offset + span;
    if (high - low < 1e-6 * std::max(std::abs(low), std::abs(high))) continue;
    const int most = n % 3 == 0 ? 1 + n % 8 : kMostLabels;
    const auto ticks = linear_ticks(low, high, most);
    check_labels(ticks, low, high, most);
    if (ticks.size() < 2) continue;
    const double step = (ticks.back().value - ticks.front().value) / double(ticks.size() - 1);
    const double m = mantissa(step);
    CAPTURE(low, high, step);
    CHECK((m == 1.0 || m == 2.0 || m == 5.0));
    for (std::size_t t = 1; t < ticks.size(); ++t) {
      CHECK(ticks[t].value - ticks[t - 1].value == Approx(step).epsilon(1e-6));
    }
    CHECK(ticks.front().value - low < step * (1.0 + 1e-6));
    CHECK(high - ticks.back().value < step * (1.0 + 1e-6));
  }
}

TEST_CASE("logarithmic ticks: three to eight labels, whatever the range") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> exponent(-90.0, 90.0), decades(-5.0, 2.0);
  for (int n = 0; n < 3000; ++n) {
    const double span = std::pow(10.0, decades(random));  // in decades
    const double low = std::pow(10.0, exponent(random) * (n % 2 ? 0.05 : 1.0));
    const double high = low * std::pow(10.0, span);
    const int most = n % 3 == 0 ? 1 + n % 8 : kMostLabels;
    const auto ticks = log_ticks(low, high, most);
    check_labels(ticks, low, high, most);
    // With three powers of ten in range, labels are powers of ten, evenly apart.
    const double inside = std::floor(std::log10(high)) - std::ceil(std::log10(low)) + 1.0;
    if (inside < 4.0) continue;
    const auto shown = labelled(ticks);
    for (std::size_t t = 0; t < shown.size(); ++t) {
      CHECK(mantissa(shown[t].value) == 1.0);
      if (t < 2) continue;
      CHECK(std::log10(shown[t].value / shown[t - 1].value) ==
            Approx(std::log10(shown[1].value / shown[0].value)));
    }
  }
}

TEST_CASE("decades are labelled as one writes them, with minor ticks at 2 and 5") {
  const auto ticks = log_ticks(0.03, 20.0);
  const auto shown = labelled(ticks);
  REQUIRE(shown.size() == 3);
  CHECK(shown[0].label == "0.1");
  CHECK(shown[1].label == "1");
  CHECK(shown[2].label == "10");
  CHECK(minor(ticks) == std::vector<double>{0.05, 0.2, 0.5, 2.0, 5.0, 20.0});
}

TEST_CASE("limits at powers of ten have their ticks, in one notation for the axis") {
  for (int first = -12; first <= 8; ++first) {
    const auto shown = labelled(log_ticks(std::pow(10.0, first), std::pow(10.0, first + 4)));
    REQUIRE(shown.size() == 5);
    const bool plain = first >= -3 && first <= 0;
    for (const Tick& tick : shown) {
      CAPTURE(tick.label);
      CHECK((tick.label.find("10⁻") != std::string::npos || meaning(tick.label) == tick.value));
      CHECK((tick.label.find_first_not_of("0.1") == std::string::npos) == plain);
    }
  }
}

TEST_CASE("less than three decades: 1, 2 and 5, with the other digits as minor ticks") {
  const auto ticks = log_ticks(0.9, 30.0);
  std::vector<double> shown;
  for (const Tick& tick : labelled(ticks)) shown.push_back(tick.value);
  CHECK(shown == std::vector<double>{1.0, 2.0, 5.0, 10.0, 20.0});
  CHECK(minor(ticks) == std::vector<double>{0.9, 3.0, 4.0, 6.0, 7.0, 8.0, 9.0, 30.0});
}
