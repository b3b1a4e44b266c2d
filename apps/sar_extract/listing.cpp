// SPDX-License-Identifier: Apache-2.0
#include "listing.h"

#include <cstdio>

#include "sarnerf/report/table.h"
#include "values.h"

namespace sarnerf::app {
namespace {

std::string box_text(const Box& box_m) {
  if (box_m.empty()) return "-";
  char text[160];
  std::snprintf(text, sizeof text, "%.4g..%.4g, %.4g..%.4g, %.4g..%.4g", box_m.min.x, box_m.max.x, box_m.min.y,
                box_m.max.y, box_m.min.z, box_m.max.z);
  return text;
}

}  // namespace

std::string listing(const Extraction& extraction) {
  const VdbSummary summary = extraction.volume.summary();
  std::vector<std::vector<std::string>> rows;
  for (const VdbGridSummary& grid : summary.grids)
    rows.push_back({grid.name, grid.type, std::to_string(grid.n_active_voxels), box_text(grid.box_m),
                    bytes_text(grid.memory_bytes)});
  std::string text = markdown_table({{"grid"},
                                     {"type"},
                                     {"voxels", Align::right},
                                     {"box x, y, z (m)"},
                                     {"memory", Align::right}},
                                    rows);
  for (const auto& [name, value] : summary.metadata) text += name + ": " + value + "\n";
  return text;
}

}  // namespace sarnerf::app
