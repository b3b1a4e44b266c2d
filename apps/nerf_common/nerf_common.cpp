// SPDX-License-Identifier: Apache-2.0
#include "nerf_common.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/nerf/lpips.h"
#include "sarnerf/report/page.h"

namespace sarnerf::app {

namespace {

constexpr std::size_t kFewViews = 48, kEvery = 12;

}  // namespace

Holdout parse_holdout(const std::string& text) {
  if (text == "auto") return {};
  if (text.find_first_of(".%") != std::string::npos)
    return {Holdout::Kind::part, parse_part("--holdout", text, 0.0, 0.99), text};
  return {Holdout::Kind::count, static_cast<double>(parse_whole("--holdout", text, 0, 10'000'000)), text};
}

std::vector<std::size_t> held_out_views(std::span<const DatasetView> views,
                                        const Holdout& holdout) {
  const std::size_t n_views = views.size();
  std::size_t n = 0;
  switch (holdout.kind) {
    case Holdout::Kind::automatic:
      n = n_views < kFewViews ? 0 : n_views / kEvery;
      break;
    case Holdout::Kind::count:
      n = static_cast<std::size_t>(holdout.value);
      break;
    case Holdout::Kind::part:
      n = static_cast<std::size_t>(std::lround(holdout.value * static_cast<double>(n_views)));
      break;
  }
  if (n >= n_views)
    throw UsageError("--holdout: of " + counted(n_views, "view") + ", " + std::to_string(n) +
                     " would be held out and none left to learn from; hold out fewer");
  std::vector<std::size_t> order(n_views);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(views[a].azimuth_deg, views[a].incidence_deg) <
           std::tie(views[b].azimuth_deg, views[b].incidence_deg);
  });
  std::vector<std::size_t> chosen;
  for (const std::size_t place : spread_indices(n_views, n)) chosen.push_back(order[place]);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::vector<std::size_t> trained_views(std::span<const DatasetView> views, std::span<const DatasetView> training) {
  std::vector<std::size_t> trained;
  for (std::size_t n = 0; n < views.size(); ++n)
    if (std::ranges::find(training, views[n].image, &DatasetView::image) != training.end()) trained.push_back(n);
  return trained;
}

std::vector<std::size_t> unseen_views(std::span<const DatasetView> views,
                                      std::span<const DatasetView> training) {
  std::vector<std::size_t> unseen;
  for (std::size_t n = 0; n < views.size(); ++n) {
    const bool seen = std::any_of(training.begin(), training.end(),
                                  [&](const DatasetView& t) { return same_angles(views[n], t); });
    if (!seen) unseen.push_back(n);
  }
  return unseen;
}

Kind<double> despeckle_degrees() { return between("DEG", 1e-3, 90.0).or_word("off", 0.0); }

std::optional<DespeckledTruth> despeckled_if_asked(double despeckle_deg, std::vector<PosedImage> unseen, bool exact_poses,
                                                   const Monitor& monitor) {
  if (despeckle_deg == 0.0) return std::nullopt;
  if (!exact_poses) register_views(unseen, kCut_pixels, 0.0, monitor);
  DespeckledTruth truth = despeckled_truth(unseen, rad_from_deg(despeckle_deg));
  if (!truth.views.empty()) return truth;
  throw UsageError("--despeckle: of " + counted(unseen.size(), "unseen view") +
                   " none has two neighbours within that azimuth, one to average with and one to compare with; allow more "
                   "degrees, or leave it out");
}

std::string despeckled_title(double despeckle_deg, const DespeckledTruth& truth) {
  char text[160];
  std::snprintf(text, sizeof text,
                "%zu despeckled views: means of every other unseen view within %.3g degrees",
                truth.views.size(), despeckle_deg);
  return text;
}

ImageDistance load_lpips(const std::filesystem::path& weights) {
  if (weights.empty()) return {};
  return Lpips(weights);
}

std::string lpips_missing(const std::filesystem::path& weights, std::span<const PosedImage> views) {
  if (weights.empty()) return "no weights were given (--lpips FILE, docs/guide/lpips.md)";
  const bool small = std::any_of(views.begin(), views.end(), [](const PosedImage& view) {
    return std::min(view.power.n_azimuth(), view.power.n_range()) < Lpips::kSmallestSide_pixels;
  });
  return small ? "images have sides shorter than the " +
                     std::to_string(Lpips::kSmallestSide_pixels) + " pixels that it needs"
               : "";
}

RegisteredSet registered_training_set(std::vector<PosedImage> images, const Box& scene_box_m, const SceneHeights& heights,
                                      const std::optional<Resolution>& resolution, const GroundRule& ground_rule,
                                      const Monitor& monitor) {
  const std::vector<Outlier> outliers = limit_outliers(images);  // one of them would decide its view's correlations
  register_views(images, kCut_pixels, 0.0, monitor);
  RegisteredSet result{training_set(std::move(images), scene_box_m, heights, resolution, ground_rule), {}};
  result.set.outliers = outliers;
  result.set.exact_poses = false;
  result.registered = result.set.images;
  for (auto* list : {&result.set.images, &result.set.deconvolved})
    for (PosedImage& image : *list) image.acquisition.azimuth_shift_m = image.acquisition.range_shift_m = 0.0;
  return result;
}

Kind<ResolutionChoice> resolution_choice() {
  const auto read = [](const std::string& text) -> ResolutionChoice {
    if (text == "auto" || text == "none") return {text == "auto", std::nullopt};
    const auto [azimuth_m, range_m] = parse_spacing_m("--resolution", text);
    return {false, Resolution{azimuth_m, range_m, {}}};
  };
  return made_by("A[,R]|auto|none", read, "auto");
}

Kind<ResolutionChoice> window_of(const ResolutionChoice& choice) {
  return made_by("NAME", [&choice](const std::string& text) {
    ResolutionChoice shaped = choice;
    if (!shaped.resolution)
      throw UsageError("--window: a window shapes an impulse response: give its --resolution too, or leave the window " + text +
                       " out");
    shaped.resolution->window = window_from_text(text);
    return shaped;
  });
}

std::string resolution_text(const Resolution& r) {
  return format("%.4g x %.4g m (azimuth x range), window %s", r.azimuth_m, r.range_m, text_of(r.window).c_str());
}

namespace {

Json json_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

Json json_of(const BackgroundScores& s) {
  return {{"log_amplitude_error_db", s.log_amplitude_error_db},
          {"psnr_log_amplitude_db", s.log_amplitude_psnr_db},
          {"looks", json_or_null(s.looks)},
          {"looks_of_truth", json_or_null(s.looks_of_truth)},
          {"target_iou", json_or_null(s.target_iou)},
          {"shadow_iou", json_or_null(s.shadow_iou)},
          {"scatterer_error_m", json_or_null(s.scatterer_error_m)}};
}

Json json_of(const BackgroundRule& rule) {
  return {{"range_db", rule.range_db},
          {"blur_pixels", rule.regions.blur_pixels},
          {"target_db", rule.regions.target_db},
          {"shadow_db", rule.regions.shadow_db},
          {"looks_window_pixels", rule.looks.window_pixels},
          {"looks_quantile", rule.looks.quantile},
          {"scatterers", rule.n_scatterers},
          {"scatterer_separation_m", rule.separation_m}};
}

Json json_of(const Scores& s) {
  Json j{{"psnr_power_db", s.psnr_power_db}, {"psnr_amplitude_db", s.psnr_amplitude_db}};
  j["psnr_target_power_db"] = json_or_null(s.psnr_target_power_db);
  j["ssim_power"] = s.ssim_power;
  j["lpips"] = json_or_null(s.lpips);
  if (s.registered) {
    j["registered_psnr_power_db"] = s.registered->psnr_power_db;
    j["registered_psnr_amplitude_db"] = s.registered->psnr_amplitude_db;
  }
  if (s.background) j["background"] = json_of(*s.background);
  return j;
}

Json json_of(const MethodScores& method) {
  Json views = Json::array();
  for (const Scores& scores : method.views) views.push_back(json_of(scores));
  return {{"name", method.name},
          {"mean", json_of(method.mean)},
          {"psnr_capped_views", method.n_capped},
          {"views", views}};
}

std::string fixed(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string fixed_or_dash(const std::optional<double>& value, int digits) {
  return value ? fixed(*value, digits) : "-";
}

/// The rows of a table: the prediction, the baselines, the bounds.
std::vector<std::pair<std::string, const MethodScores*>> methods_of(const Evaluation& evaluation,
                                                                    const std::string& model) {
  std::vector<std::pair<std::string, const MethodScores*>> methods;
  if (evaluation.prediction) methods.emplace_back(model, &*evaluation.prediction);
  for (const auto* list : {&evaluation.baselines, &evaluation.bounds})
    for (const MethodScores& method : *list) methods.emplace_back(method.name, &method);
  return methods;
}

std::string background_table(const Evaluation& evaluation, const std::string& model) {
  std::vector<std::vector<std::string>> rows;
  std::optional<double> looks_of_truth;
  for (const auto& [name, method] : methods_of(evaluation, model)) {
    const BackgroundScores& s = *method->mean.background;
    rows.push_back({name, fixed(s.log_amplitude_error_db, 2), fixed(s.log_amplitude_psnr_db, 2),
                    fixed_or_dash(s.looks, 1), fixed_or_dash(s.target_iou, 3),
                    fixed_or_dash(s.shadow_iou, 3), fixed_or_dash(s.scatterer_error_m, 2)});
    looks_of_truth = s.looks_of_truth;
  }
  std::string table = markdown_table({{"method", Align::left},
                                      {"log-amplitude error (dB)", Align::right},
                                      {"PSNR log amplitude (dB)", Align::right},
                                      {"looks", Align::right},
                                      {"IoU target", Align::right},
                                      {"IoU shadow", Align::right},
                                      {"scatterer position error (m)", Align::right}},
                                     rows);
  if (looks_of_truth) table += "\nlooks of the truth: " + fixed(*looks_of_truth, 1) + "\n";
  return table;
}

}  // namespace

Json evaluation_json(const Evaluation& evaluation) {
  Json j;
  j["peak_power"] = evaluation.peak_power;
  j["target"] = {{"share_of_peak", evaluation.target.share_of_peak},
                 {"dilation_pixels", evaluation.target.dilation_pixels}};
  if (evaluation.background) j["background"] = json_of(*evaluation.background);
  j["views"] = Json::array();
  for (const EvaluatedView& view : evaluation.views)
    j["views"].push_back({{"image", view.name},
                          {"azimuth_deg", deg_from_rad(view.azimuth_rad)},
                          {"incidence_deg", deg_from_rad(view.incidence_rad)}});
  if (evaluation.prediction) j["model"] = json_of(*evaluation.prediction);
  j["baselines"] = Json::array();
  for (const MethodScores& method : evaluation.baselines) j["baselines"].push_back(json_of(method));
  if (!evaluation.bounds.empty()) j["bounds"] = Json::array();
  for (const MethodScores& method : evaluation.bounds) j["bounds"].push_back(json_of(method));
  if (const auto margin_db = evaluation.margin_db()) {
    j["best_baseline"] = evaluation.best_baseline()->name;
    j["margin_db"] = *margin_db;
  }
  return j;
}

std::string evaluation_table(const Evaluation& evaluation, const std::string& model) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, method] : methods_of(evaluation, model)) {
    const Scores& m = method->mean;
    rows.push_back({name, fixed(m.psnr_power_db, 2), fixed(m.psnr_amplitude_db, 2),
                    fixed_or_dash(m.psnr_target_power_db, 2), fixed(m.ssim_power, 4),
                    fixed_or_dash(m.lpips, 4)});
  }
  const std::string table = markdown_table({{"method", Align::left},
                                            {"PSNR power (dB)", Align::right},
                                            {"PSNR amplitude (dB)", Align::right},
                                            {"PSNR target (dB)", Align::right},
                                            {"SSIM", Align::right},
                                            {"LPIPS", Align::right}},
                                           rows);
  return evaluation.background ? table + "\n" + background_table(evaluation, model) : table;
}

namespace {

constexpr int kGap = 2;
constexpr double kFullColour = 0.25;  ///< fraction of the peak

Colour grey(std::uint8_t level) { return {level, level, level}; }

Colour signed_colour(double share) {
  constexpr double kNeutral = 128.0;
  const double s = std::clamp(share, -1.0, 1.0);
  const auto toward = [&](double full) {
    return static_cast<std::uint8_t>(std::lround(kNeutral + std::abs(s) * (full - kNeutral)));
  };
  return s >= 0.0 ? Colour{toward(255.0), toward(40.0), toward(40.0)}
                  : Colour{toward(40.0), toward(90.0), toward(255.0)};
}

}  // namespace

std::vector<std::byte> comparison_picture(std::span<const Image<float>* const> images, const Image<float>& truth,
                                          const Image<float>& prediction, float white, float peak) {
  const int n_azimuth = truth.n_azimuth(), n_range = truth.n_range();
  const int n_images = static_cast<int>(images.size());
  Image<Colour> picture(n_azimuth, (n_images + 1) * n_range + n_images * kGap, grey(255));
  int left = 0;
  for (const Image<float>* image : images) {
    const auto levels = display_levels(*image, Quantity::power, white);
    for (int i = 0; i < n_azimuth; ++i)
      for (int j = 0; j < n_range; ++j) picture(i, left + j) = grey(levels(i, j));
    left += n_range + kGap;
  }
  for (int i = 0; i < n_azimuth; ++i)
    for (int j = 0; j < n_range; ++j)
      picture(i, left + j) =
          signed_colour((double{prediction(i, j)} - double{truth(i, j)}) / (kFullColour * double{peak}));
  return encode_png(picture);
}

}  // namespace sarnerf::app
