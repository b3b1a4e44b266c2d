// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "options.h"

namespace sarnerf::app {

using Json = nlohmann::ordered_json;

/// A recipe says how an image or a dataset was made, completely: "request" holds every setting and the
/// fingerprints of the files given, and is known before the scene is loaded; "resolved" holds what the
/// program then chose. Output whose recipe is the same is the same output, byte for byte. Threads,
/// memory limits, folders and times are no part of it.
Json request_of(const Options& options);

/// The whole recipe. `resolved` is the caller's.
Json make_recipe(const Json& request, const Json& resolved);

/// The recipe in a file, or nothing when the file is missing or something else.
std::optional<Json> read_recipe(const std::filesystem::path& path);

std::string recipe_text(const Json& recipe);

/// Names the first places where two recipes (or parts of them) differ, as "image.size: 64 instead of
/// 128"; empty when they are equal.
std::string difference(const Json& found, const Json& wanted);

}  // namespace sarnerf::app
