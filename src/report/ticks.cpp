// SPDX-License-Identifier: Apache-2.0
#include "ticks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace sarnerf {
namespace {

const std::string kMinus = "\xE2\x88\x92";  // −
const std::string kTimesTen =
    "\xC2\xB7"
    "10";  // ·10

/// m × 10^e, correctly rounded wherever 10^|e| is exact: 3 × 10⁻¹ is 0.3 and not 3 × 0.1.
double scaled(double m, int e) { return e < 0 ? m / std::pow(10.0, -e) : m * std::pow(10.0, e); }

std::string superscript(int exponent) {
  static const std::array<std::string, 10> digits{
      "\xE2\x81\xB0", "\xC2\xB9",     "\xC2\xB2",     "\xC2\xB3",     "\xE2\x81\xB4",
      "\xE2\x81\xB5", "\xE2\x81\xB6", "\xE2\x81\xB7", "\xE2\x81\xB8", "\xE2\x81\xB9"};
  std::string text = exponent < 0 ? "\xE2\x81\xBB" : "";
  for (const char digit : std::to_string(std::abs(exponent)))
    text += digits[std::size_t(digit - '0')];
  return text;
}

/// m × 10^e written out: 250, 0.025.
std::string plain_label(long long m, int e) {
  std::string digits = std::to_string(std::llabs(m));
  if (e >= 0 && m != 0) digits.append(std::size_t(e), '0');
  if (e < 0) {
    const auto decimals = std::size_t(-e);
    if (digits.size() <= decimals) digits.insert(0, decimals + 1 - digits.size(), '0');
    digits.insert(digits.size() - decimals, ".");
  }
  return (m < 0 ? kMinus : "") + digits;
}

/// m × 10^e as 2.5·10⁻⁷; a power of ten as 10⁻⁷.
std::string power_label(long long m, int e) {
  if (m == 0) return "0";
  std::string digits = std::to_string(std::llabs(m));
  const int exponent = e + int(digits.size()) - 1;
  while (digits.size() > 1 && digits.back() == '0') digits.pop_back();
  const std::string sign = m < 0 ? kMinus : "";
  if (digits == "1") return sign + "10" + superscript(exponent);
  if (digits.size() > 1) digits.insert(1, ".");
  return sign + digits + kTimesTen + superscript(exponent);
}

/// A tick at m × 10^e.
struct Place {
  long long m = 0;
  int e = 0;
  double value() const { return scaled(double(m), e); }
};

/// Rounding must not cost the tick that lies on a limit.
bool within(double value, double low, double high) {
  const double slack = 1e-12 * std::max(std::abs(low), std::abs(high));
  return value >= low - slack && value <= high + slack;
}

/// 1, 2, 5 times 10^e within the limits, or whichever multiples are asked for.
std::vector<Place> multiples(double low, double high, std::initializer_list<int> of) {
  std::vector<Place> places;
  const int first = int(std::floor(std::log10(low))) - 1,
            last = int(std::ceil(std::log10(high))) + 1;
  for (int e = first; e <= last; ++e) {
    for (const int m : of) {
      if (within(scaled(m, e), low, high)) places.push_back({m, e});
    }
  }
  return places;
}

/// Multiples of `step` powers of ten, counted from 10⁰.
std::vector<Place> every(const std::vector<Place>& decades, int step) {
  std::vector<Place> kept;
  for (const Place& p : decades) {
    if (p.e % step == 0) kept.push_back(p);
  }
  return kept;
}

/// Labels in one way for the whole axis: written out as long as all are short.
void add_labelled(std::vector<Tick>& ticks, const std::vector<Place>& places) {
  const bool plain = std::all_of(places.begin(), places.end(), [](const Place& p) {
    return p.value() > 0.9e-3 && p.value() < 1.1e4;
  });
  for (const Place& p : places) {
    ticks.push_back({p.value(), plain ? plain_label(p.m, p.e) : power_label(p.m, p.e)});
  }
}

void add_minor(std::vector<Tick>& ticks, const std::vector<Place>& places) {
  for (const Place& p : places) ticks.push_back({p.value()});
}

}  // namespace

std::vector<Tick> linear_ticks(double low, double high, int most_labels) {
  // From a step that is certainly too small, upwards.
  int e = int(std::floor(std::log10(high - low))) - 2;
  for (;; ++e) {
    for (const int m : {1, 2, 5}) {
      const double step = scaled(m, e);
      // Rounding up to a limit's own tick, as within() does.
      const double slack = 1e-12 * std::max(std::abs(low), std::abs(high)) / step;
      const auto first = (long long)(std::ceil(low / step - slack));
      const auto last = (long long)(std::floor(high / step + slack));
      if (last - first + 1 > most_labels) continue;
      const double largest = std::max(std::abs(low), std::abs(high));
      const bool plain = largest < 1e6 && (e > -6 || largest >= 1e-3);
      std::vector<Tick> ticks;
      for (long long n = first; n <= last; ++n) {
        ticks.push_back(
            {scaled(double(n * m), e), plain ? plain_label(n * m, e) : power_label(n * m, e)});
      }
      return ticks;
    }
  }
}

std::vector<Tick> log_ticks(double low, double high, int most_labels) {
  std::vector<Tick> ticks;
  const auto decades = multiples(low, high, {1});
  const auto fine = multiples(low, high, {1, 2, 5});
  const auto most = std::size_t(most_labels);
  if (decades.size() >= 3 || (fine.size() > most && !decades.empty())) {
    int step = 1;
    for (const int larger : {1, 2, 3, 5, 10, 20, 30, 50, 100, 200}) {
      step = larger;
      if (every(decades, step).size() <= most) break;
    }
    add_labelled(ticks, every(decades, step));
    if (step > 1) {
      for (const Place& p : decades) {
        if (p.e % step != 0) add_minor(ticks, {p});
      }
    } else {
      add_minor(ticks, multiples(low, high, {2, 5}));
    }
  } else if (fine.size() >= 3 && fine.size() <= most) {
    add_labelled(ticks, fine);
    add_minor(ticks, multiples(low, high, {3, 4, 6, 7, 8, 9}));
  } else {
    ticks = linear_ticks(low, high, most_labels);
  }
  std::sort(ticks.begin(), ticks.end(),
            [](const Tick& a, const Tick& b) { return a.value < b.value; });
  return ticks;
}

std::vector<Tick> ticks(AxisScale scale, double low, double high, int most_labels) {
  return scale == AxisScale::log ? log_ticks(low, high, most_labels)
                                 : linear_ticks(low, high, most_labels);
}

}  // namespace sarnerf
