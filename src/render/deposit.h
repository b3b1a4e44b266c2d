// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace sarnerf {

/// Spreads `mass` over range bins: a uniform density on [x0, x1] (either order) smeared by a box of
/// width |smear|, all in bin coordinates, where bin j covers [j, j + 1). Exact integration of that
/// trapezoid over each bin; what falls outside the bins is dropped.
///
/// This is what makes the image free of aliasing with few rays: between neighbouring rays a plane spans
/// the interval [x0, x1], and over the width of a sub-row it moves by `smear`.
/// Cost: a few ns, plus about 2 ns for each bin touched.
void deposit_trapezoid(std::span<double> bins, double x0, double x1, double smear, double mass);

}  // namespace sarnerf
