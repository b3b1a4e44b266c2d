// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

namespace sarnerf {

inline constexpr double kPi = std::numbers::pi;

/// Degrees are used only at the command line and in files; all code uses radians.
constexpr double rad_from_deg(double angle_deg) { return angle_deg * (kPi / 180.0); }
constexpr double deg_from_rad(double angle_rad) { return angle_rad * (180.0 / kPi); }

/// Units of length that scenes and the command line know, for messages.
inline constexpr std::string_view kUnitsOfLength = "m, cm, mm, km, in, ft";

/// Metres of one unit of this name; empty for another name.
constexpr std::optional<double> metres_of_unit(std::string_view name) {
  constexpr std::pair<std::string_view, double> kUnits[] = {{"m", 1.0},     {"cm", 0.01},   {"mm", 0.001},
                                                           {"km", 1000.0}, {"in", 0.0254}, {"ft", 0.3048}};
  for (const auto& [unit, metres] : kUnits)
    if (unit == name) return metres;
  return {};
}

}  // namespace sarnerf
