// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

namespace sarnerf::app {

/// The path without an ending of an image's files: "-o a.tif" means a.tif, a.png and a.json; an empty `output` means
/// `default_name`, and a folder gets files of that name. Throws UsageError for the folder of a dataset.
std::filesystem::path image_base(const std::string& output, const std::string& default_name);

/// The base with an ending, whatever dots are in its name.
std::filesystem::path with_ending(const std::filesystem::path& base, const std::string& ending);

/// Throws Error unless the folder can be written to, or created. Creates nothing.
void require_possible(const std::filesystem::path& folder);

/// Removes the files of a folder, and none of folders in it, that meet a condition; a folder that is missing has none.
void remove_files(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::path&)>& condition);

/// Throws UsageError when a file to be written is one of the inputs; empty ones are passed over.
void refuse_input(const std::filesystem::path& output,
                  std::span<const std::filesystem::path> inputs);

/// Throws UsageError for an output inside a folder that is read: the next reader would take its files for more of the same.
void refuse_inside(const std::filesystem::path& output, std::span<const std::filesystem::path> input_folders);

}  // namespace sarnerf::app
