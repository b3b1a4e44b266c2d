// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "console.h"
#include "nerf_common.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/formation/clutter.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/nerf/model_file.h"

namespace sarnerf::app {

/// The speckle of new views.
struct SpeckleChoice {
  enum class Kind { none, looks, training };
  Kind kind = Kind::none;
  double looks = 1.0;  ///< of Kind::looks
};

/// What the user asked for. Empty optionals and lists are taken from the model.
struct Options {
  std::filesystem::path model;  ///< the file, or the folder of a run

  std::filesystem::path views;  ///< dataset whose views are rendered; empty: by angles
  std::vector<double> incidence_deg;
  std::vector<double> azimuth_deg{0.0};
  std::optional<double> altitude_m;
  std::optional<double> slant_range_m;
  std::optional<Look> look;
  std::optional<std::pair<int, int>> size;  ///< azimuth, range
  std::optional<std::pair<double, double>> spacing_m;
  std::optional<Quantity> quantity;
  ResolutionChoice resolution;  ///< automatic: the model's
  SpeckleChoice speckle;
  std::int64_t seed = 1;  ///< of the speckle

  std::filesystem::path against;   ///< empty: new views are rendered
  std::filesystem::path training;  ///< empty: the folder that the model names
  std::filesystem::path lpips;
  double despeckle_deg = 0.0;  ///< 0: single views are the only truth

  std::string output;
  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;  ///< print the plan and stop
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file.
std::optional<Options> parse_options(int argc, char** argv);

/// The model, and the views to render from it.
struct Job {
  Options options;
  Model model;
  Quantity quantity = Quantity::power;
  std::vector<DatasetView> views;  ///< image names still empty
  ClutterModel clutter;            ///< none: looks are infinite
  Json request;                    ///< of the recipe
};

/// Reads the model and sets up the views; warns of parts of the model that are ignored. Throws CheckpointError for a
/// bad model, GeometryError for impossible views, UsageError for more memory than allowed.
Job prepare(const Options& options, Console& console, const Monitor& monitor);

/// The images that the model was learned from. Throws InputError if they are not where the model, or --training, says, or are others.
std::vector<PosedImage> training_images(const Job& job, const Monitor& monitor);

/// The view's image in the quantity asked for, with speckle if that is asked for. Throws NumericsError when a pixel is not finite.
Image<float> make_image(const Job& job, const DatasetView& view);

/// The plan as text.
std::string explain(const Job& job);

/// report.json of an image or a sweep: the only output that depends on clock and threads.
std::string report_text(const Job& job, std::size_t n_rendered, double render_s);

/// Name of this program in recipes.
inline constexpr const char* kProgram = "sar_nerf_render";

/// Predicts the views of --against, and scores the predictions beside interpolation between the training images. With
/// -o, writes evaluation.json into that folder. Returns the table of means. Throws UsageError if nothing can be
/// compared, InputError for bad datasets, CheckpointError for a field without occupied voxels.
std::string compare(const Job& job, Console& console, const Monitor& monitor);

/// Renders the job's only view to NAME.tif, NAME.png, NAME.report.json and NAME.json, the recipe, which comes last. Returns
/// the files' names, one a line. Throws UsageError when other output is in the way.
std::string write_single_view(const Job& job, Console& console, const Monitor& monitor);

/// Renders the job's views into a dataset folder in the format of sar_render (docs/guide/outputs.md). Continues an
/// earlier run of the same recipe; interruptions do not change the bytes. Returns the manifest's name. Throws
/// UsageError when other output is in the way, Interrupted after writing a manifest of the finished views.
std::string write_sweep(const Job& job, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
