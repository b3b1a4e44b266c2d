// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "job.h"

namespace sarnerf::app {

/// A line for each option that was given and changes nothing about this job, with what would give it an effect.
std::vector<std::string> unused_options(const Job& job);

}  // namespace sarnerf::app
