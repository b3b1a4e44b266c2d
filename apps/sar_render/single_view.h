// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "job.h"

namespace sarnerf::app {

/// Before loading: throws UsageError when other output is in the way, and Error when none can be written.
void check_single_view(const Options& options, const Json& request);

/// Renders the job's one view and writes NAME.tif, NAME.png, NAME.json and NAME.report.json, all or none;
/// or finds that this has been done. Returns the paths, one a line.
std::string write_single_view(Job& job, const Json& request, const Stopwatch& total, Console& console,
                              const Monitor& monitor);

}  // namespace sarnerf::app
