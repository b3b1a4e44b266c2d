// SPDX-License-Identifier: Apache-2.0
#include "view_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "values.h"

namespace sarnerf::app {
namespace {

constexpr std::size_t kFewViews = 48, kEvery = 12;
constexpr double kSameAngle_deg = 1e-6;

}  // namespace

Holdout parse_holdout(const std::string& text) {
  if (text == "auto") return {};
  if (text.find_first_of(".%") != std::string::npos)
    return {Holdout::Kind::part, parse_part("--holdout", text, 0.0, 0.99)};
  return {Holdout::Kind::count, static_cast<double>(parse_whole("--holdout", text, 0, 10'000'000))};
}

std::vector<std::size_t> spread_places(std::size_t count, std::size_t most) {
  const std::size_t n = std::min(count, most);
  std::vector<std::size_t> places(n);
  for (std::size_t k = 0; k < n; ++k) places[k] = (2 * k + 1) * count / (2 * n);
  return places;
}

std::vector<std::size_t> held_out_views(std::span<const DatasetView> views,
                                        const Holdout& holdout) {
  const std::size_t n_views = views.size();
  std::size_t n = 0;
  switch (holdout.kind) {
    case Holdout::Kind::automatic:
      n = n_views < kFewViews ? 0 : n_views / kEvery;
      break;
    case Holdout::Kind::count:
      n = static_cast<std::size_t>(holdout.value);
      break;
    case Holdout::Kind::part:
      n = static_cast<std::size_t>(std::lround(holdout.value * static_cast<double>(n_views)));
      break;
  }
  if (n >= n_views)
    throw UsageError("--holdout: of " + counted(n_views, "view") + ", " + std::to_string(n) +
                     " would be held out and none left to learn from; hold out fewer");
  std::vector<std::size_t> order(n_views);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(views[a].azimuth_deg, views[a].incidence_deg) <
           std::tie(views[b].azimuth_deg, views[b].incidence_deg);
  });
  std::vector<std::size_t> chosen;
  for (const std::size_t place : spread_places(n_views, n)) chosen.push_back(order[place]);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

bool same_angles(const DatasetView& a, const DatasetView& b) {
  return std::abs(std::remainder(a.azimuth_deg - b.azimuth_deg, 360.0)) < kSameAngle_deg &&
         std::abs(a.incidence_deg - b.incidence_deg) < kSameAngle_deg && a.look == b.look;
}

std::vector<std::size_t> unseen_views(std::span<const DatasetView> views,
                                      std::span<const DatasetView> training) {
  std::vector<std::size_t> unseen;
  for (std::size_t n = 0; n < views.size(); ++n) {
    const bool seen = std::any_of(training.begin(), training.end(),
                                  [&](const DatasetView& t) { return same_angles(views[n], t); });
    if (!seen) unseen.push_back(n);
  }
  return unseen;
}

}  // namespace sarnerf::app
