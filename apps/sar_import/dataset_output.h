// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "selection.h"

namespace sarnerf::app {

/// Writes the chosen images into a dataset folder of sar_render's form (docs/outputs.md): float32 TIFF, pictures,
/// manifest, recipe, checksums, report. Goes on where an earlier run of the same recipe stopped; the same bytes whatever
/// the threads and interruptions. Returns the manifest's path and a summary. Throws UsageError when other output is in
/// the way, Interrupted after writing a manifest of the finished views.
std::string write_dataset(const Options& options, const Choice& choice, Console& console,
                          const Monitor& monitor);

}  // namespace sarnerf::app
