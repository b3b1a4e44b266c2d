// SPDX-License-Identifier: Apache-2.0
#include "evaluation_output.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "sarnerf/core/units.h"
#include "sarnerf/report/table.h"

namespace sarnerf::app {
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

/// The rows of a table: the prediction, the baselines, what bounds them.
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
                                      {"scatterers off by (m)", Align::right}},
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

}  // namespace sarnerf::app
