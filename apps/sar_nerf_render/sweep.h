// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "job.h"

namespace sarnerf::app {

/// Renders the job's views into a dataset folder of sar_render's form (docs/outputs.md), and goes on where an earlier run
/// of the same recipe stopped. The same bytes whatever the interruptions. Returns the manifest's name. Throws UsageError
/// when other output is in the way, Interrupted after writing a manifest of the finished views.
std::string write_sweep(const Job& job, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
