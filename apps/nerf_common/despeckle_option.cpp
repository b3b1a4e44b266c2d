// SPDX-License-Identifier: Apache-2.0
#include "despeckle_option.h"

#include <cstdio>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/units.h"
#include "values.h"

namespace sarnerf::app {

double parse_despeckle_deg(const std::string& text) {
  return text == "off" ? 0.0 : parse_between("--despeckle", text, 1e-3, 90.0);
}

std::optional<DespeckledTruth> despeckled_if_asked(double despeckle_deg,
                                                   std::span<const PosedImage> unseen) {
  if (despeckle_deg == 0.0) return std::nullopt;
  DespeckledTruth truth = despeckled_truth(unseen, rad_from_deg(despeckle_deg));
  if (!truth.views.empty()) return truth;
  throw UsageError("--despeckle: of " + counted(unseen.size(), "unseen view") +
                   " none has two more within its degrees of azimuth, one to be averaged "
                   "with and one to compare; allow more degrees, or leave it out");
}

std::string despeckled_title(double despeckle_deg, const DespeckledTruth& truth) {
  char text[160];
  std::snprintf(text, sizeof text,
                "%zu despeckled views: means of every other unseen view within %.3g degrees",
                truth.views.size(), despeckle_deg);
  return text;
}

}  // namespace sarnerf::app
