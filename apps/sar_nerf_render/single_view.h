// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "job.h"

namespace sarnerf::app {

/// Renders the job's only view to NAME.tif, NAME.png, NAME.report.json and NAME.json, the recipe, which comes last. Returns
/// the files' names, one a line. Throws UsageError when other output is in the way.
std::string write_single_view(const Job& job, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
