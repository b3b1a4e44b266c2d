// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/despeckled_truth.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "interpolate_between.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

namespace sarnerf {
namespace {

/// Every other view from the first one on, by azimuth.
std::vector<const PosedImage*> every_other(Views sorted, std::size_t first) {
  std::vector<const PosedImage*> some;
  for (std::size_t n = first; n < sorted.size(); n += 2) some.push_back(sorted[n]);
  return some;
}

std::vector<Neighbour> within(Views views, const Acquisition& wanted, double reach_rad) {
  // What lies at the very limit counts, however its angle was rounded.
  const double limit = reach_rad + 1e-9;
  std::vector<Neighbour> near;
  for (const PosedImage* view : views) {
    const double turn = view->acquisition.azimuth_rad - wanted.azimuth_rad;
    if (std::abs(std::remainder(turn, 2.0 * kPi)) <= limit) near.push_back({view, 0.0});
  }
  for (Neighbour& n : near) n.weight = 1.0 / double(near.size());
  return near;
}

}  // namespace

DespeckledTruth despeckled_truth(std::span<const PosedImage> unseen, double reach_rad) {
  if (!(reach_rad > 0.0 && reach_rad < kPi)) {
    throw UsageError("views are averaged over less than half a turn to both sides; asked for " +
                     std::to_string(deg_from_rad(reach_rad)) + " degrees");
  }
  DespeckledTruth result;
  if (unseen.empty()) return result;
  for (Pitch& pitch : pitches(checked_views(unseen))) {
    std::stable_sort(pitch.views.begin(), pitch.views.end(),
                     [](const PosedImage* a, const PosedImage* b) {
                       return a->acquisition.azimuth_rad < b->acquisition.azimuth_rad;
                     });
    const auto odd = every_other(pitch.views, 0), even = every_other(pitch.views, 1);
    for (const PosedImage* view : odd) {
      const Acquisition& wanted = view->acquisition;
      const auto of_truth = within(odd, wanted, reach_rad), others = within(even, wanted, reach_rad);
      if (of_truth.size() < 2 || others.empty()) continue;
      result.which.push_back(static_cast<std::size_t>(view - unseen.data()));
      result.views.push_back(
          {view->name, wanted, weighted_mean(of_truth, wanted, Warp::turn, 0.0)});
      result.true_neighbours.push_back(weighted_mean(others, wanted, Warp::turn, 0.0));
    }
  }
  return result;
}

}  // namespace sarnerf
