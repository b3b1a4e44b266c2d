// SPDX-License-Identifier: Apache-2.0
#include "resolution_option.h"

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "values.h"

namespace sarnerf::app {

ResolutionChoice parse_resolution(const std::string& resolution, const std::string& window) {
  if (resolution == "auto" || resolution == "none") {
    if (!window.empty())
      throw UsageError("--window: a window shapes an impulse response: give its --resolution too, or leave the window " + window +
                       " out");
    return {resolution == "auto", std::nullopt};
  }
  const auto [azimuth_m, range_m] = parse_spacing_m("--resolution", resolution);
  return {false, Resolution{azimuth_m, range_m, window_from_text(window.empty() ? "none" : window)}};
}

std::string resolution_text(const Resolution& r) {
  return format("%.4g x %.4g m (azimuth x range), window %s", r.azimuth_m, r.range_m, text_of(r.window).c_str());
}

}  // namespace sarnerf::app
