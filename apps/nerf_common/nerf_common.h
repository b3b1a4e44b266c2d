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
#include "values.h"

namespace sarnerf::app {

/// How many views are kept away from training.
struct Holdout {
  enum class Kind { automatic, count, part };
  Kind kind = Kind::automatic;
  double value = 0.0;
  std::string text = "auto";  ///< as it was given
};

/// "auto", a count or a part ("0.1", "10%"). Throws UsageError.
Holdout parse_holdout(const std::string& text);

/// Places of the views to hold out, in the dataset's order: evenly spread in the order of azimuth, then incidence.
/// `automatic`: every twelfth where there are at least 48, else none, for every view counts there. Throws UsageError
/// when no view is left to learn from.
std::vector<std::size_t> held_out_views(std::span<const DatasetView> views, const Holdout& holdout);

/// Up to `most` of `count` places, evenly spread, the first quarter step in.
std::vector<std::size_t> spread_places(std::size_t count, std::size_t most);

/// Whether two views were taken from the same direction, to a millionth of a degree, and side.
bool same_angles(const DatasetView& a, const DatasetView& b);

/// Places of the views whose angles no training view has.
std::vector<std::size_t> unseen_views(std::span<const DatasetView> views,
                                      std::span<const DatasetView> training);

/// What --despeckle takes: degrees, at most 90; 0 for "off".
Kind<double> despeckle_degrees();

/// The despeckled truth of views that nobody trained on; none where the option is off. Throws UsageError where no view
/// has the neighbours that it takes.
std::optional<DespeckledTruth> despeckled_if_asked(double despeckle_deg,
                                                   std::span<const PosedImage> unseen);

/// What the truth is, above its table.
std::string despeckled_title(double despeckle_deg, const DespeckledTruth& truth);

/// The distance of --lpips; empty without a file. Images that are too small for the network have none: see
/// lpips_missing(). Throws InputError for a bad file.
ImageDistance load_lpips(const std::filesystem::path& weights);

/// Why these views have no LPIPS; empty where they have it.
std::string lpips_missing(const std::filesystem::path& weights, std::span<const PosedImage> views);

/// What --resolution and --window say: an impulse response, none, or that others know.
struct ResolutionChoice {
  bool automatic = true;
  std::optional<Resolution> resolution;  ///< unless automatic

  /// What is chosen where `known` is what is known.
  std::optional<Resolution> or_else(const std::optional<Resolution>& known) const { return automatic ? known : resolution; }
};

/// What --resolution takes: "auto", "none" or metres.
Kind<ResolutionChoice> resolution_choice();

/// What --window takes: the same choice with a window, which only metres can have.
Kind<ResolutionChoice> window_of(const ResolutionChoice& choice);

/// "0.305 x 0.305 m (azimuth x range), window taylor:-35,4"
std::string resolution_text(const Resolution& resolution);

/// The evaluation as JSON: peak, mask, and for each method its means and its scores view by view; what needs a
/// background, and bounds, where there are any.
Json evaluation_json(const Evaluation& evaluation);

/// Means of all methods as a Markdown table, the prediction first; `model` is its name there. A second table follows
/// where the views have a background.
std::string evaluation_table(const Evaluation& evaluation, const std::string& model);

/// A PNG for the eye: images side by side, and last the difference of a prediction from its truth. Images in decibels of one
/// scale, white at `white`, of power; the difference is linear in what truth and prediction hold, prediction minus truth: red
/// above, blue below, grey where equal, full colour at a quarter of `peak`. All of one size.
std::vector<std::byte> comparison_picture(std::span<const Image<float>* const> images, const Image<float>& truth,
                                          const Image<float>& prediction, float white, float peak);

}  // namespace sarnerf::app
