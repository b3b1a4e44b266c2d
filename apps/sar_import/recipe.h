// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recipe_file.h"
#include "selection.h"

namespace sarnerf::app {

/// The recipe of a dataset: what was asked for, and the chosen files with their SHA-256. Reads all of them.
Json recipe_of(const Options& options, const std::vector<Source>& chosen, const Monitor& monitor);

/// What the run took, as JSON.
std::string report_text(const Options& options, const Choice& choice, std::size_t n_written);

}  // namespace sarnerf::app
