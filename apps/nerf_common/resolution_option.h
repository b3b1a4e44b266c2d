// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "sarnerf/core/impulse_response.h"

namespace sarnerf::app {

/// What --resolution and --window say: an impulse response, none, or that others know.
struct ResolutionChoice {
  bool automatic = true;
  std::optional<Resolution> resolution;  ///< unless automatic

  /// What is chosen where `known` is what is known.
  std::optional<Resolution> or_else(const std::optional<Resolution>& known) const { return automatic ? known : resolution; }
};

/// "auto", "none" or metres, with a window where there are metres ("none" unless told). Throws UsageError.
ResolutionChoice parse_resolution(const std::string& resolution, const std::string& window);

/// "0.305 x 0.305 m (azimuth x range), window taylor:-35,4"
std::string resolution_text(const Resolution& resolution);

}  // namespace sarnerf::app
