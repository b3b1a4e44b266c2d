// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

namespace sarnerf {

/// ‖a − b‖₂ / ‖a‖₂ over rows from `first_row` on; NaN for a blank `a`.
double relative_difference(const Image<float>& a, const Image<float>& b, int first_row = 0);

/// scale · |a − b|; 0 in rows before `first_row`.
Image<float> error_map(const Image<float>& a, const Image<float>& b, int first_row, double scale);

}  // namespace sarnerf
