// SPDX-License-Identifier: Apache-2.0
#include "number_text.h"

#include <array>
#include <charconv>
#include <cmath>

namespace sarnerf {
namespace {

/// The same in every locale.
std::string written(double value, std::chars_format format, int digits) {
  std::array<char, 400> buffer;  // the largest double has 309 digits before the point
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format, digits).ptr;
  return {buffer.data(), end};
}

/// A minus as wide as a plus, and none before zero.
std::string with_minus(const std::string& text) {
  if (text[0] != '-') return text;
  const bool zero = text.find_first_not_of("-0.") == std::string::npos;
  return (zero ? "" : "−") + text.substr(1);
}

std::string two_digits(long number) { return (number < 10 ? "0" : "") + std::to_string(number); }

}  // namespace

std::string decimal(double value, int digits) {
  if (std::isnan(value)) return "–";
  if (std::isinf(value)) return value > 0.0 ? "∞" : "−∞";
  return with_minus(written(value, std::chars_format::fixed, digits));
}

std::string decimal(const std::optional<double>& value, int digits) {
  return value ? decimal(*value, digits) : "–";
}

std::string degrees(double angle_deg) {
  std::string text = decimal(angle_deg, 2);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text + "°";
}

std::string signed_decimal(double value, int digits) {
  const std::string text = decimal(value, digits);
  const bool zero = text.find_first_not_of("0.") == std::string::npos;
  return value > 0.0 && !zero ? "+" + text : text;
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return decimal(value, 0);
  return with_minus(written(value, std::chars_format::general, digits));
}

std::string duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0.0) return decimal(seconds, 0) + " s";
  if (seconds < 9.995) return decimal(seconds, 2) + " s";
  if (seconds < 59.95) return decimal(seconds, 1) + " s";
  if (seconds >= 1e15) return significant(seconds, 3) + " s";
  const long whole = std::lround(seconds);
  if (whole < 3600) return std::to_string(whole / 60) + " min " + two_digits(whole % 60) + " s";
  const long minutes = std::lround(seconds / 60.0);
  return std::to_string(minutes / 60) + " h " + two_digits(minutes % 60) + " min";
}

std::string count(std::size_t number, const std::string& thing) {
  return std::to_string(number) + ' ' + thing + (number == 1 ? "" : "s");
}

}  // namespace sarnerf
