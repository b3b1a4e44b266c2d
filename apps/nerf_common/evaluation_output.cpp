// SPDX-License-Identifier: Apache-2.0
#include "evaluation_output.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "sarnerf/core/units.h"
#include "sarnerf/report/table.h"

namespace sarnerf::app {
namespace {

Json json_of(const Scores& s) {
  Json j{{"psnr_power_db", s.psnr_power_db}, {"psnr_amplitude_db", s.psnr_amplitude_db}};
  j["psnr_target_power_db"] = s.psnr_target_power_db ? Json(*s.psnr_target_power_db) : Json();
  j["ssim_power"] = s.ssim_power;
  j["lpips"] = s.lpips ? Json(*s.lpips) : Json();
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

}  // namespace

Json evaluation_json(const Evaluation& evaluation) {
  Json j;
  j["peak_power"] = evaluation.peak_power;
  j["target"] = {{"share_of_peak", evaluation.target.share_of_peak},
                 {"dilation_pixels", evaluation.target.dilation_pixels}};
  j["views"] = Json::array();
  for (const EvaluatedView& view : evaluation.views)
    j["views"].push_back({{"image", view.name},
                          {"azimuth_deg", deg_from_rad(view.azimuth_rad)},
                          {"incidence_deg", deg_from_rad(view.incidence_rad)}});
  if (evaluation.prediction) j["model"] = json_of(*evaluation.prediction);
  j["baselines"] = Json::array();
  for (const MethodScores& method : evaluation.baselines) j["baselines"].push_back(json_of(method));
  if (const auto margin_db = evaluation.margin_db()) {
    j["best_baseline"] = evaluation.best_baseline()->name;
    j["margin_db"] = *margin_db;
  }
  return j;
}

std::string evaluation_table(const Evaluation& evaluation, const std::string& model) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const std::string& name, const MethodScores& method) {
    const Scores& m = method.mean;
    rows.push_back({name, fixed(m.psnr_power_db, 2), fixed(m.psnr_amplitude_db, 2),
                    m.psnr_target_power_db ? fixed(*m.psnr_target_power_db, 2) : "-",
                    fixed(m.ssim_power, 4), m.lpips ? fixed(*m.lpips, 4) : "-"});
  };
  if (evaluation.prediction) add(model, *evaluation.prediction);
  for (const MethodScores& method : evaluation.baselines) add(method.name, method);
  return markdown_table({{"method", Align::left},
                         {"PSNR power (dB)", Align::right},
                         {"PSNR amplitude (dB)", Align::right},
                         {"PSNR target (dB)", Align::right},
                         {"SSIM", Align::right},
                         {"LPIPS", Align::right}},
                        rows);
}

}  // namespace sarnerf::app
