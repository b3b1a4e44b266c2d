// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "options.h"
#include "recipe_file.h"

namespace sarnerf::app {

/// Name of this program in recipes.
inline constexpr const char* kProgram = "sar_render";

/// The "request" of a recipe: every setting, and the fingerprints of the files given; known before the scene is loaded.
/// "resolved" then holds what the program chose.
Json request_of(const Options& options);

}  // namespace sarnerf::app
