// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>

// Catch2 3 on Debian 13, Catch2 2 on Debian 12.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif

/// The larger error; one that is not a number is infinite (std::max() would pass it over).
inline double worse(double so_far, double error) {
  return std::isnan(error) ? std::numeric_limits<double>::infinity() : error > so_far ? error : so_far;
}
