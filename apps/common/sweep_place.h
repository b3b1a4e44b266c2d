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

/// Writes a recipe, and its checksum into the list: with that, a recipe that is damaged later is
/// known to be this one.
void write_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums);

/// Whether the file holds this recipe; or did, by the list of checksums, and is now damaged or gone: then it is written
/// again. Throws UsageError for another recipe, and for one that is damaged and not known.
bool holds_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums);

/// Makes the folder that of this recipe: keeps what is there of the same one, empties it where `overwrite` or nothing is
/// there. Only while the folder is locked. Throws UsageError as holds_recipe().
void take_sweep_place(const SweepFolder& folder, const Json& recipe, bool overwrite);

}  // namespace sarnerf::app
