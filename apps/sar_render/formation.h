// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "options.h"
#include "recipe.h"
#include "sarnerf/core/impulse_response.h"

namespace sarnerf::app {

/// Pixels rendered on every side of the image and cut off after its formation, so that its borders receive what leaks into
/// them from beyond. The size must be decided. Zero without an impulse response.
Border border_of(const Options& options);

/// What the user asked for, for recipes and provenance: only what is on.
Json formation_request(const ImageFormation& formation);

/// What follows from it: bandwidth, sidelobes, taps.
Json formation_resolved(const Options& options, const Border& border);

/// What is done, for --explain, a line each; and what is left out, empty if nothing.
std::vector<std::string> formation_lines(const Options& options, const Border& border);
std::string formation_left_out(const ImageFormation& formation);

}  // namespace sarnerf::app
