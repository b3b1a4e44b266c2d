// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "console.h"
#include "options.h"
#include "sarnerf/core/monitor.h"

namespace sarnerf::app {

/// Extracts, scores and writes; returns what is printed on stdout. Output of the same recipe that is there already is
/// only told of. With --dry-run returns the plan and writes nothing. Throws UsageError where other output is in the way, or
/// another program is writing the same.
std::string extract_and_write(const Options& options, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
