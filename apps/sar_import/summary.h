// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "selection.h"

namespace sarnerf::app {

/// What the chosen images are, for people: sets, azimuths and their widest gaps, spacings, what is assumed. One line
/// each, beginning with two spaces.
std::string summary_text(const Choice& choice);

/// The plan: source, choice, what is left out and why, reading convention, output.
std::string plan_text(const Options& options, const Choice& choice);

}  // namespace sarnerf::app
