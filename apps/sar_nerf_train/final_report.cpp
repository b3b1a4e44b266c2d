// SPDX-License-Identifier: Apache-2.0
#include "final_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "comparison_picture.h"
#include "evaluation_output.h"
#include "process.h"
#include "report_page.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/stopwatch.h"
#include "sarnerf/dataset/despeckled_evaluation.h"
#include "sarnerf/dataset/display.h"
#include "torch_setup.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr std::size_t kDespeckledPictures = 8;

void predict(const ReportInput& in, Findings& findings, const Monitor& monitor) {
  for (const PosedImage& truth : in.data.validation) {
    monitor.check();
    findings.predictions.push_back(render_view(in.run.field(), truth.acquisition));
    monitor.report("predict views", findings.predictions.size(), in.data.validation.size());
  }
}

void write_picture(const ReportInput& in, const char* kind, std::size_t view, std::vector<const Image<float>*> images,
                   const Image<float>& truth, const Image<float>& prediction, float peak) {
  char name[40];
  std::snprintf(name, sizeof name, "%s_%03zu.png", kind, view);
  AtomicFiles files(Durability::process);
  files.add(in.folder.pictures() / name,
            comparison_picture(images, truth, prediction, white_level(*images.front()), peak));
  files.commit();
}

void write_pictures(const ReportInput& in, const Findings& findings) {
  for (const std::size_t v : in.run.curve().views()) {
    const Image<float>&truth = in.data.validation[v].power, &prediction = findings.predictions[v];
    write_picture(in, "view", v, {&truth, &prediction}, truth, prediction, in.trainer.set().peak);
  }
}

Image<float> amplitudes(Image<float> power) {
  for (float& p : power.pixels()) p = std::sqrt(std::max(p, 0.0f));
  return power;
}

/// A single view, its despeckled truth, the prediction, the baseline that comes closest, and the prediction's difference:
/// of amplitudes, full colour at an eighth of the largest one, since differences of power would show single glints.
void write_despeckled_pictures(const ReportInput& in, const Findings& findings,
                               std::span<const Baseline> baselines) {
  const MethodScores* const best = findings.despeckled->best_baseline();
  if (best == nullptr) return;
  const auto baseline = std::find_if(baselines.begin(), baselines.end(),
                                     [&](const Baseline& b) { return name(b) == best->name; });
  const DespeckledTruth& truth = *in.data.despeckled;
  const std::size_t n = std::min(truth.views.size(), kDespeckledPictures);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t t = k * truth.views.size() / n, v = truth.which[t];
    const Image<float>&mean = truth.views[t].power, &prediction = findings.predictions[v];
    const Image<float> other = baseline_view(in.trainer.set().images, truth.views[t].acquisition, *baseline);
    write_picture(in, "despeckled", v, {&in.data.validation[v].power, &mean, &prediction, &other}, amplitudes(mean),
                  amplitudes(prediction), 0.5f * std::sqrt(in.trainer.set().peak));
  }
}

/// Scores, and the pictures of despeckled views, which show the best baseline beside.
void judge(const ReportInput& in, Findings& findings, const Monitor& monitor) {
  EvaluationSettings settings;
  settings.peak_power = double{in.trainer.set().peak};
  findings.lpips_missing = lpips_missing(in.options.lpips, in.data.validation);
  if (findings.lpips_missing.empty()) {
    settings.lpips = in.lpips;
    use_torch_threads(in.options.shared.n_threads);
  }
  const auto& training = in.trainer.set().images;
  settings.baselines = default_baselines(training, monitor);
  findings.evaluation =
      evaluate(in.data.validation, findings.predictions, training, settings, monitor);
  if (in.data.despeckled) {
    findings.despeckled = evaluate_despeckled(*in.data.despeckled, findings.predictions, training,
                                              settings, monitor);
    write_despeckled_pictures(in, findings, *settings.baselines);
  }
}

std::string json_text(const ReportInput& in, const Findings& findings) {
  Json j;
  j["format"] = "sarnerf-training-report";
  j["version"] = 1;
  j["program"] = "sar_nerf_train " + std::string(kVersion);
  j["dataset"] = {{"sha256", in.data.fingerprint},
                  {"training_views", in.data.training_views.size()},
                  {"held_out_views", in.data.n_held_out},
                  {"against_views", in.data.validation.size() - in.data.n_held_out}};
  j["field"] = {{"kind", in.run.field().kind()}, {"size", in.run.field_size()}};
  j["steps"] = in.trainer.steps_done();
  j["steps_of_the_model"] = in.run.field_steps();
  j["steps_of_this_program"] = in.run.steps_here();
  j["seconds"] = Json::object();
  for (const auto& [stage, seconds] : findings.times.stages) j["seconds"][stage] = seconds;
  j["seconds"]["until trained"] = in.run.trained_until_s();
  j["seconds"]["all programs of the run"] = in.run.seconds();
  j["machine"] = {{"processor", processor_name()},
                  {"threads", in.options.shared.n_threads},
                  {"libraries", torch_text()}};
  j["memory_bytes"] = {{"peak", peak_memory_bytes()}};
  j["evaluation"] = findings.evaluation ? evaluation_json(*findings.evaluation) : Json();
  if (findings.despeckled) j["despeckled"] = evaluation_json(*findings.despeckled);
  if (!findings.lpips_missing.empty()) j["lpips_missing"] = findings.lpips_missing;
  return j.dump(2) + "\n";
}

/// ", 36 unseen views at 48.12 dB, 7.90 dB above 'nearest view'": of power.
std::string score_text(const Evaluation& evaluation, const char* kind_of_view) {
  std::string text = format(", %s at %.2f dB", counted(evaluation.views.size(), kind_of_view).c_str(),
                            evaluation.prediction->mean.psnr_power_db);
  if (const auto margin_db = evaluation.margin_db())
    text += format(", %.2f dB %s '%s'", std::abs(*margin_db), *margin_db < 0.0 ? "below" : "above",
                   evaluation.best_baseline()->name.c_str());
  return text;
}

}  // namespace

void write_reports(const ReportInput& in, StageTimes times, Console& console,
                   const Monitor& monitor) {
  Findings findings;
  findings.times = std::move(times);
  if (!in.data.validation.empty()) {
    const Stopwatch evaluating;
    predict(in, findings, monitor);
    judge(in, findings, monitor);
    write_pictures(in, findings);
    findings.times.add("final evaluation", evaluating.seconds());
  }
  const Stopwatch reporting;
  write_file_atomically(in.folder.page(), training_report_html(report_of(in, findings)),
                        Durability::process);
  findings.times.add("report", reporting.seconds());
  write_file_atomically(in.folder.report(), json_text(in, findings), Durability::process);

  char text[200];
  std::snprintf(text, sizeof text, "trained %lld steps in %.3g s, all done after %.3g s",
                static_cast<long long>(in.trainer.steps_done()), in.run.trained_until_s(),
                in.run.seconds());
  std::string line = text;
  if (in.run.field_steps() != in.trainer.steps_done())
    line += ", of which the model of step " + std::to_string(in.run.field_steps()) + " was best";
  if (findings.evaluation) line += score_text(*findings.evaluation, "unseen view");
  if (findings.despeckled) line += score_text(*findings.despeckled, "despeckled view");
  console.note(line);
}

}  // namespace sarnerf::app
