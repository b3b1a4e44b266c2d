// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "recipe_file.h"
#include "sweep_folder.h"

namespace sarnerf::app {

/// Throws UsageError: other output is in the way, for this reason.
[[noreturn]] void refuse_place(const std::filesystem::path& folder, const std::string& why);

/// Before long work: throws UsageError where a file, or output of another request, is in the folder's place, and Error
/// where none can be written.
void require_sweep_place(const SweepFolder& folder, const Json& request, bool overwrite);

}  // namespace sarnerf::app
