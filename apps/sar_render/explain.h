// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "job.h"

namespace sarnerf::app {

/// The plan of a job for its user: what will be computed and with what settings, what is left out and
/// why, rays, bytes and seconds expected. `place` is where the output goes.
std::string explain(const Job& job, const std::string& place);

}  // namespace sarnerf::app
