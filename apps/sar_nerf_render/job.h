// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "console.h"
#include "options.h"
#include "recipe_file.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/nerf/model_file.h"

namespace sarnerf::app {

/// The model, and the views to be made of it.
struct Job {
  Options options;
  Model model;
  Quantity quantity = Quantity::power;
  std::vector<DatasetView> views;  ///< image names still empty
  Json request;                    ///< of the recipe
};

/// Reads the model and sets up the views; warns of what it ignores. Throws CheckpointError for a bad model, GeometryError
/// for impossible views, UsageError for more memory than allowed.
Job prepare(const Options& options, Console& console);

/// The view's image in the quantity asked for. Throws NumericsError when a pixel is not finite.
Image<float> make_image(const Job& job, const DatasetView& view);

/// What is made, for people.
std::string explain(const Job& job);

/// report.json of an image or a sweep: the only output that depends on clock and threads.
std::string report_text(const Job& job, std::size_t n_rendered, double render_s);

/// Name of this program in recipes.
inline constexpr const char* kProgram = "sar_nerf_render";

}  // namespace sarnerf::app
