// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sarnerf {

/// Whether an image can have this depression (deg): the incidence, 90 less it, lies inside (0°, 90°) after rounding,
/// too.
constexpr bool is_depression(double depression_deg) {
  return depression_deg > 0.0 && depression_deg < 90.0 && 90.0 - depression_deg < 90.0;
}

}  // namespace sarnerf
