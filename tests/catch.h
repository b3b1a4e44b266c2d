// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <string>

// Catch2 3 on Debian 13, Catch2 2 on Debian 12.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
using Catch::Matchers::ContainsSubstring;
#else
#include <catch2/catch.hpp>
inline auto ContainsSubstring(const std::string& text) { return Catch::Contains(text); }
#endif

/// Equal within an absolute margin and nothing else: Approx::margin() alone also accepts a relative error of 1.2e-5.
inline Approx within_margin(double expected, double margin) { return Approx(expected).epsilon(0.0).margin(margin); }

/// The larger error; one that is not a number is infinite (std::max() would pass it over).
inline double worse(double so_far, double error) {
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error > so_far ? error : so_far;
}
