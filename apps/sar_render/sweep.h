// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "job.h"

namespace sarnerf::app {

/// Before loading: throws UsageError when other output is in the way, and Error when none can be written.
void check_sweep(const Options& options, const Json& request);

/// Renders the job's views into a dataset folder:
///
///     recipe.json            written first; the same recipe continues where an earlier run stopped
///     images/view_000.tif    each view's files appear whole, in any order
///     png/view_000.png
///     dataset.json           written last, the manifest
///     dataset.report.json    times
///
/// Views that are there are not rendered again; the bytes of everything but the report do not depend on
/// threads or interruptions. Throws Interrupted after writing a manifest of the finished views. Returns
/// the manifest's path, one line.
std::string write_sweep(Job& job, const Json& request, const Stopwatch& total, Console& console,
                        const Monitor& monitor);

}  // namespace sarnerf::app
