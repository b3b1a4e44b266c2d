// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "console.h"
#include "options.h"
#include "sarnerf/core/monitor.h"

namespace sarnerf::app {

/// Writes each view of a dataset as chip_000.phoenix, …, with recipe.json and SHA256SUMS beside; files that are there
/// and whole are kept. Returns what is printed on stdout. Throws UsageError when other output is in the way.
std::string write_phoenix_chips(const Options& options, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
