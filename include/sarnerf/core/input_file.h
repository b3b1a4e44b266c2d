// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

/// The one door through which files named by users are opened. A pipe would wait for ever, a device has no
/// end: only regular files pass, and nothing else is opened at all.
namespace sarnerf {

/// Size in bytes. Throws InputError, in one line, for what is missing, no regular file, or out of reach.
std::uint64_t regular_file_size(const std::filesystem::path& path);

/// The whole content; the file may be empty. Throws InputError as regular_file_size() does, and for a file
/// that cannot be opened or that ends early.
std::string read_whole_file(const std::filesystem::path& path);

}  // namespace sarnerf
