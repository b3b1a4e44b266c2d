// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "console.h"

namespace sarnerf::bench {

struct PageOptions {
  std::filesystem::path input, output;
  bool quiet = false;
};

/// Writes a Markdown file as one HTML page (page_of_markdown()). Pictures are files relative to it; those of a dataset's images
/// (float32) are shown in decibels.
void run_page_command(const PageOptions& options, app::Console& console);

struct StripOptions {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path trained, output;
  int zoom = 1;
  bool quiet = false;
};

/// Writes a picture of the views of several datasets: those of the first from left to right, each above the same view (azimuth and
/// incidence to 0.01 degrees) of the others. White is the 99.9th percentile of the first dataset's brightest view. Frames mark
/// views that `trained` has. Throws UsageError where a view is missing, or of another size.
void run_strip_command(const StripOptions& options, app::Console& console);

}  // namespace sarnerf::bench
