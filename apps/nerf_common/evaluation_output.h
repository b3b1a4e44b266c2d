// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "recipe_file.h"
#include "sarnerf/dataset/evaluation.h"

namespace sarnerf::app {

/// The evaluation as JSON: peak, mask, and for each method its means and its scores view by view.
Json evaluation_json(const Evaluation& evaluation);

/// Means of all methods as a Markdown table, the prediction first; `model` is its name there.
std::string evaluation_table(const Evaluation& evaluation, const std::string& model);

}  // namespace sarnerf::app
