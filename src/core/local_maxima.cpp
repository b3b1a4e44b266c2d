// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/local_maxima.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

bool exceeded(const Image<float>& image, int i, int j) {
  for (int a = std::max(0, i - 1); a <= std::min(image.n_azimuth() - 1, i + 1); ++a) {
    for (int b = std::max(0, j - 1); b <= std::min(image.n_range() - 1, j + 1); ++b)
      if (image(a, b) > image(i, j)) return true;
  }
  return false;
}

double distance_m(const LocalMaximum& a, const LocalMaximum& b, const MaximaRule& rule) {
  return std::hypot((a.i - b.i) * rule.azimuth_spacing_m, (a.j - b.j) * rule.range_spacing_m);
}

double nearest_m(const LocalMaximum& a, const std::vector<LocalMaximum>& others,
                 const MaximaRule& rule) {
  double nearest = distance_m(a, others.front(), rule);
  for (const LocalMaximum& b : others) nearest = std::min(nearest, distance_m(a, b, rule));
  return nearest;
}

void check(const MaximaRule& rule) {
  if (rule.most >= 1 && rule.separation_m >= 0.0 && rule.azimuth_spacing_m > 0.0 &&
      rule.range_spacing_m > 0.0) {
    return;
  }
  throw UsageError("local maxima are at least one, of positive spacing and no negative separation");
}

}  // namespace

std::vector<LocalMaximum> strongest_maxima(const Image<float>& image, double floor,
                                           const MaximaRule& rule) {
  check(rule);
  std::vector<LocalMaximum> all;
  for (int i = 0; i < image.n_azimuth(); ++i) {
    for (int j = 0; j < image.n_range(); ++j) {
      if (double(image(i, j)) > floor && !exceeded(image, i, j)) all.push_back({i, j, image(i, j)});
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const LocalMaximum& a, const LocalMaximum& b) { return a.value > b.value; });
  std::vector<LocalMaximum> strongest;
  for (const LocalMaximum& m : all) {
    if (static_cast<int>(strongest.size()) == rule.most) break;
    if (strongest.empty() || nearest_m(m, strongest, rule) >= rule.separation_m)
      strongest.push_back(m);
  }
  return strongest;
}

double mean_distance_m(const std::vector<LocalMaximum>& reference,
                       const std::vector<LocalMaximum>& others, const MaximaRule& rule) {
  if (reference.empty() || others.empty())
    throw UsageError("no distance to where there is no local maximum");
  double sum_m = 0.0;
  for (const LocalMaximum& m : reference) sum_m += nearest_m(m, others, rule);
  return sum_m / double(reference.size());
}

}  // namespace sarnerf
