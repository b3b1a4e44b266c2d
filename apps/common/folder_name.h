// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace sarnerf::app {

/// The path without the slash that shells put behind folders.
std::filesystem::path without_slash(const std::filesystem::path& folder);

/// The folder of a dataset: what was named, or where the dataset.json lies that was.
std::filesystem::path dataset_folder(const std::filesystem::path& dataset);

/// Absolute, without links and dots and without a slash at its end: it ends in a name, which "." and ".." do not.
std::filesystem::path full_path(const std::filesystem::path& path);

}  // namespace sarnerf::app
