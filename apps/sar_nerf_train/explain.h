// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "data.h"
#include "options.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf::app {

/// The plan for people: what is learned from what, for how long, and what is left out and why.
std::string explain(const Options& options, const Data& data, const Trainer& trainer);

/// What a run does without, and why: pairs of both.
std::vector<std::pair<std::string, std::string>> left_out(const Options& options, const Data& data);

}  // namespace sarnerf::app
