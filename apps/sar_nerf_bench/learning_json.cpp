// SPDX-License-Identifier: Apache-2.0
#include "learning_output.h"

namespace sarnerf::bench {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const LearningRun& run) {
  Json points = Json::array();
  for (const LearningPoint& p : run.points)
    points.push_back({{"seconds", p.seconds},
                      {"cpu_seconds", p.cpu_seconds},
                      {"step", p.step},
                      {"psnr_power_db", p.psnr_db}});
  Json j{{"field", run.field},
         {"planned_s", run.planned_s},
         {"seed", run.seed},
         {"start_s", run.start_s},
         {"points", points}};
  if (!run.diverged.empty()) j["diverged"] = run.diverged;
  return j;
}

}  // namespace

Json learning_json(const LearningStudy& study) {
  Json baselines = Json::array(), runs = Json::array();
  for (const auto& [name, psnr_db] : study.baselines)
    baselines.push_back({{"name", name}, {"psnr_power_db", psnr_db}});
  for (const LearningRun& run : study.runs) runs.push_back(json_of(run));
  return {{"dataset", study.dataset},
          {"training_views", study.n_training_views},
          {"views", study.views},
          {"peak_power", study.peak_power},
          {"baselines", baselines},
          {"runs", runs}};
}

}  // namespace sarnerf::bench
