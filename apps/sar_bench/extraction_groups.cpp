// SPDX-License-Identifier: Apache-2.0
#include "extraction_groups.h"

#include <algorithm>
#include <cmath>

namespace sarnerf::bench {

std::vector<ExtractionGroup> groups_of(const std::vector<ExtractionRun>& runs) {
  std::vector<ExtractionGroup> groups;
  for (const ExtractionRun& run : runs) {
    const auto same = [&](const ExtractionGroup& g) {
      return g.scene == run.scene && g.views.text() == run.views.text() && g.planned_s == run.planned_s;
    };
    auto group = std::ranges::find_if(groups, same);
    if (group == groups.end()) group = groups.insert(groups.end(), {run.scene, run.views, run.planned_s, {}});
    if (run.failed.empty()) group->ended.push_back(&run);
  }
  return groups;
}

Spread spread_of(const ExtractionGroup& group, ExtractionQuantity quantity) {
  std::vector<double> values;
  for (const ExtractionRun* run : group.ended)
    if (std::isfinite(run->*quantity)) values.push_back(run->*quantity);
  if (values.empty()) return {};
  double sum = 0.0;
  for (const double value : values) sum += value;
  const auto [least, most] = std::ranges::minmax(values);
  return {sum / static_cast<double>(values.size()), least, most};
}

}  // namespace sarnerf::bench
