// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "options.h"

namespace sarnerf::app {

/// Files of a single view.
struct ImagePaths {
  std::filesystem::path tiff, png, report;
  std::filesystem::path recipe;  ///< appears last: where it is, the others are whole

  /// The file of a layer, by its ending.
  std::filesystem::path layer(const std::string& ending) const;
};
ImagePaths image_paths(const Options& options);

/// Folder of a sweep.
std::filesystem::path sweep_folder(const Options& options);

/// Where the output of these options goes, for people.
std::string output_text(const Options& options);

/// Throws UsageError where --save-volume would replace something, before any work.
void require_volume_place(const Options& options);

/// Throws UsageError when a file to be written is one of the inputs.
void refuse_input(const std::filesystem::path& output, const Options& options);

}  // namespace sarnerf::app
