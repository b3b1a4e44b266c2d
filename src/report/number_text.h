// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace sarnerf {

/// A number with `digits` after the point: "−3.20", "∞"; "–" for what is no number.
std::string decimal(double value, int digits);

/// The same of what may not have been computed: "–" then.
std::string decimal(const std::optional<double>& value, int digits);

/// An angle in degrees with up to two digits, no trailing zeros: "12.5°", "45°".
std::string degrees(double angle_deg);

/// With the sign in front also of what is positive: "+5.61".
std::string signed_decimal(double value, int digits);

/// A number to `digits` significant ones, without trailing zeros: "0.05", "12".
std::string significant(double value, int digits);

/// A time that people grasp: "0.83 s", "12.4 s", "3 min 20 s", "1 h 05 min".
std::string duration(double seconds);

/// "1 view", "24 views".
std::string count(std::size_t number, const std::string& thing);

}  // namespace sarnerf
