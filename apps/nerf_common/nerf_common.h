// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recipe_file.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/nerf/training_set.h"
#include "values.h"

namespace sarnerf::app {

/// How many views are kept away from training.
struct Holdout {
  enum class Kind { automatic, count, part };
  Kind kind = Kind::automatic;
  double value = 0.0;
  std::string text = "auto";  ///< as given
};

/// Reads "auto", a count or a fraction ("0.1", "10%"). Throws UsageError.
Holdout parse_holdout(const std::string& text);

/// Indices of the views to hold out, ascending. They are evenly spread over the views sorted by azimuth, then
/// incidence. `automatic`: every twelfth view if there are at least 48, else none, because a small dataset needs
/// every view. Throws UsageError if no view is left to learn from.
std::vector<std::size_t> held_out_views(std::span<const DatasetView> views, const Holdout& holdout);

/// Indices of the views whose images have the names of training views.
std::vector<std::size_t> trained_views(std::span<const DatasetView> views, std::span<const DatasetView> training);

/// Indices of the views whose angles no training view has.
std::vector<std::size_t> unseen_views(std::span<const DatasetView> views,
                                      std::span<const DatasetView> training);

/// The value of --despeckle: degrees, at most 90; 0 for "off".
Kind<double> despeckle_degrees();

/// The despeckled truth of views that were not trained on; nothing if the option is off. Views whose poses are not exact are first registered
/// to one another, never to a method's output, so that all methods have the same truth. Throws UsageError if no view has the
/// neighbours that this needs.
std::optional<DespeckledTruth> despeckled_if_asked(double despeckle_deg, std::vector<PosedImage> unseen, bool exact_poses,
                                                   const Monitor& monitor);

/// Title of the table: describes the despeckled truth.
std::string despeckled_title(double despeckle_deg, const DespeckledTruth& truth);

/// The LPIPS distance with the weights of --lpips; empty without a file. Images that are too small for the network
/// have none: see lpips_missing(). Throws InputError for a bad file.
ImageDistance load_lpips(const std::filesystem::path& weights);

/// The reason why these views have no LPIPS; empty if they have it.
std::string lpips_missing(const std::filesystem::path& weights, std::span<const PosedImage> views);

/// A training set of views that are registered, and its images with the shifts that their correlation found, before a field has
/// learned their gains.
struct RegisteredSet {
  TrainingSet set;
  std::vector<PosedImage> registered;
};

/// training_set() of views whose poses are not exact. Registers the views to one another first (register_views()), since the
/// ground's height shows in views that fit onto one another. The set itself has shifts of 0: the field learns its own. Neighbouring
/// views hardly constrain shifts that vary slowly with azimuth, and a field that starts from a wrong shift keeps it.
RegisteredSet registered_training_set(std::vector<PosedImage> images, const Box& scene_box_m, const SceneHeights& heights = {},
                                      const std::optional<Resolution>& resolution = {}, const GroundRule& ground_rule = {},
                                      const Monitor& monitor = {});

/// The choice of --resolution and --window: an impulse response, none, or automatic (the one that is known from elsewhere).
struct ResolutionChoice {
  bool automatic = true;
  std::optional<Resolution> resolution;  ///< ignored if automatic

  /// The impulse response to use: `known` if the choice is automatic, else the one chosen.
  std::optional<Resolution> or_else(const std::optional<Resolution>& known) const { return automatic ? known : resolution; }
};

/// The value of --resolution: "auto", "none" or metres.
Kind<ResolutionChoice> resolution_choice();

/// The value of --window: the same choice with a window, which needs a resolution in metres. Throws UsageError without one.
Kind<ResolutionChoice> window_of(const ResolutionChoice& choice);

/// "0.305 x 0.305 m (azimuth x range), window taylor:-35,4"
std::string resolution_text(const Resolution& resolution);

/// The evaluation as JSON: peak, mask, and for each method its means and its scores view by view. Scores that need a
/// background, and bounds, appear where there are any.
Json evaluation_json(const Evaluation& evaluation);

/// Means of all methods as a Markdown table, the prediction first; `model` is its name there. A second table follows
/// where the views have a background.
std::string evaluation_table(const Evaluation& evaluation, const std::string& model);

/// A PNG for the eye: images side by side, and last the difference prediction minus truth. Images show power in
/// decibels on one scale, white at `white`. The difference is linear in the values of truth and prediction: red
/// above, blue below, grey where equal, full colour at a quarter of `peak`. All images have one size.
std::vector<std::byte> comparison_picture(std::span<const Image<float>* const> images, const Image<float>& truth,
                                          const Image<float>& prediction, float white, float peak);

}  // namespace sarnerf::app
