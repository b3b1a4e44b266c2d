// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace sarnerf::app {

/// The path without the slash that shells put behind folders.
std::filesystem::path without_slash(const std::filesystem::path& folder);

/// Absolute, without links and dots and without a slash at its end: it ends in a name, which "." and ".." do not.
std::filesystem::path full_path(const std::filesystem::path& path);

}  // namespace sarnerf::app
