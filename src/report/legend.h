// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "sarnerf/report/plot.h"
#include "svg_writer.h"

namespace sarnerf {

/// A series in the legend: a piece of its line with its marker in the middle, and its name.
struct LegendEntry {
  std::size_t series = 0;
  Stroke sample;
  std::vector<PlacedText> lines;
};

struct Legend {
  Rect box;
  std::vector<LegendEntry> entries;
};

/// The legend with its upper left corner at the origin: columns of equal width, filled one after the other, as
/// many as fit into `width_px` but at most `max_columns`. Names break when wider than that. No
/// entries when no series has a name.
Legend legend_of(const Plot& plot, double width_px, std::size_t max_columns);

/// The same elsewhere.
Legend moved(Legend legend, Spot by);

}  // namespace sarnerf
