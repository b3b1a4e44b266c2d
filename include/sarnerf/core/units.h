// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace sarnerf {

inline constexpr double kPi = std::numbers::pi;

/// Degrees are used only at the command line and in files; all code uses radians.
constexpr double rad_from_deg(double angle_deg) { return angle_deg * (kPi / 180.0); }
constexpr double deg_from_rad(double angle_rad) { return angle_rad * (180.0 / kPi); }

}  // namespace sarnerf
