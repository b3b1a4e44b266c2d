// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace sarnerf::app {

using Json = nlohmann::ordered_json;

/// The whole recipe: how an image or a dataset was made, completely. `request` is what was asked for, `resolved` what
/// followed from it. Output whose recipe is the same is the same output, byte for byte. Threads, memory limits,
/// folders and times are no part of it.
Json make_recipe(const std::string& program, const Json& request, const Json& resolved);

/// The recipe in a file, or nothing when the file is missing or something else.
std::optional<Json> read_recipe(const std::filesystem::path& path);

std::string recipe_text(const Json& recipe);

/// Names the first places where two recipes (or parts of them) differ, as "image.size: 64 instead of
/// 128"; empty when they are equal.
std::string difference(const Json& found, const Json& wanted);

/// The same with what is not UTF-8 replaced, as it comes back from a file: names of files may be any bytes.
Json valid_text(const Json& json);

}  // namespace sarnerf::app
