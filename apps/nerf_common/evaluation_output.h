// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "recipe_file.h"
#include "sarnerf/dataset/evaluation.h"

namespace sarnerf::app {

/// The evaluation as JSON: peak, mask, and for each method its means and its scores view by view; what needs a
/// background, and bounds, where there are any.
Json evaluation_json(const Evaluation& evaluation);

/// Means of all methods as a Markdown table, the prediction first; `model` is its name there. A second table follows
/// where the views have a background.
std::string evaluation_table(const Evaluation& evaluation, const std::string& model);

}  // namespace sarnerf::app
