// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "sarnerf/report/plot.h"

namespace sarnerf {

/// What an axis shows.
struct AxisRange {
  AxisScale scale = AxisScale::linear;
  double low = 0.0, high = 1.0;

  bool shows(double value) const { return value >= low && value <= high; }
  /// 0 at `low`, 1 at `high`; beyond for values outside.
  double share(double value) const;
};

/// The limits of `plot.x` and `plot.y`: those given, else 4 % beyond the data, bars and notes included. An open
/// linear limit does not leave zero behind when no value does. Throws UsageError as svg() says.
AxisRange x_range(const Plot& plot);
AxisRange y_range(const Plot& plot);

/// Throws UsageError for values that have no place on their axis; see svg().
void check_values(const Plot& plot);

}  // namespace sarnerf
