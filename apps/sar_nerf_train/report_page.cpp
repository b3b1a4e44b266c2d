// SPDX-License-Identifier: Apache-2.0
#include "report_page.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "despeckle_option.h"
#include "explain.h"
#include "flat_toml.h"
#include "process.h"
#include "torch_setup.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr std::size_t kMostPictures = 4, kPicturesOfTraining = 2;

ReportScores scores_of(const Scores& s) {
  ReportScores r{s.psnr_power_db, s.psnr_amplitude_db, s.psnr_target_power_db, s.ssim_power,
                 s.lpips};
  if (!s.background) return r;
  r.log_amplitude_error_db = s.background->log_amplitude_error_db;
  r.psnr_log_amplitude_db = s.background->log_amplitude_psnr_db;
  r.looks = s.background->looks;
  r.target_iou = s.background->target_iou;
  r.shadow_iou = s.background->shadow_iou;
  r.scatterer_error_m = s.background->scatterer_error_m;
  return r;
}

ReportMethod method_of(const MethodScores& method, const std::string& name) {
  ReportMethod m{name, scores_of(method.mean), {}};
  for (const Scores& scores : method.views) m.per_view.push_back(scores_of(scores));
  return m;
}

ReportView view_of(const DatasetView& v) { return {v.image, v.azimuth_deg, v.incidence_deg}; }

void add_scores(const ReportInput& in, const Findings& findings, TrainingReport& r) {
  for (const DatasetView& view : in.data.validation_views) r.held_out.push_back(view_of(view));
  for (const DatasetView& view : in.data.training_views)
    r.training_azimuths_deg.push_back(view.azimuth_deg);
  r.peak_power = double{in.trainer.set().peak};
  r.lpips_missing = findings.lpips_missing;
  if (!findings.evaluation) return;
  const Evaluation& e = *findings.evaluation;
  char text[160];
  std::snprintf(text, sizeof text,
                "pixels of the truth above %.3g %% of its peak, widened by %d pixels",
                100.0 * e.target.share_of_peak, e.target.dilation_pixels);
  r.mask = text;
  if (e.prediction)
    r.model = method_of(*e.prediction, "SAR-NeRF, " + std::string(in.run.field().kind()));
  for (const MethodScores& m : e.baselines) r.baselines.push_back(method_of(m, m.name));
  const auto views = in.run.curve().views();
  for (const MethodScores& m : e.baselines) {
    double sum_db = 0.0;
    for (const std::size_t n : views) sum_db += m.views[n].psnr_power_db;
    if (!views.empty()) r.levels.push_back({m.name, sum_db / static_cast<double>(views.size())});
  }
}

void add_despeckled(const ReportInput& in, const Findings& findings, TrainingReport& r) {
  if (!findings.despeckled) return;
  const Evaluation& e = *findings.despeckled;
  ReportComparison comparison{despeckled_title(in.options.despeckle_deg, *in.data.despeckled), {}};
  if (e.prediction) comparison.methods.push_back(method_of(*e.prediction, r.model->name));
  for (const auto* list : {&e.baselines, &e.bounds})
    for (const MethodScores& m : *list) comparison.methods.push_back(method_of(m, m.name));
  r.comparisons.push_back(std::move(comparison));
}

void add_curve(const ReportInput& in, TrainingReport& r) {
  ReportCurve curve{std::string(in.run.field().kind()), {}, true};
  for (const MetricsLine& line : in.run.metrics().lines()) {
    if (line.psnr_db) curve.points.push_back({line.seconds, *line.psnr_db});
  }
  if (curve.points.empty()) return;
  r.curves.push_back(std::move(curve));
  r.curve_views = std::to_string(in.run.curve().views().size()) + " of the " +
                  std::to_string(in.data.validation.size()) + " unseen views, evenly spread";
}

void add_pictures(const ReportInput& in, const Findings& findings, TrainingReport& r) {
  for (const std::size_t n : spread_places(in.data.validation.size(), kMostPictures)) {
    ReportPictures p;
    p.view = view_of(in.data.validation_views[n]);
    if (findings.evaluation && findings.evaluation->prediction)
      p.scores = scores_of(findings.evaluation->prediction->views[n]);
    p.truth = in.data.validation[n].power;
    p.prediction = findings.predictions[n];
    r.pictures.push_back(std::move(p));
  }
  if (!in.data.validation.empty()) return;
  const auto& images = in.trainer.set().images;
  for (const std::size_t n : spread_places(images.size(), kPicturesOfTraining)) {
    ReportPictures p;
    p.view = view_of(in.data.training_views[n]);
    p.truth = images[n].power;
    p.prediction = render_view(in.run.field(), images[n].acquisition);
    p.held_out = false;
    r.pictures.push_back(std::move(p));
  }
}

void add_configuration(const ReportInput& in, TrainingReport& r) {
  std::istringstream text(in.config);
  for (const FlatItem& item : read_flat_toml(text, "config.toml")) {
    for (const std::string& value : item.values) {
      const auto equals = item.name == "option" ? value.find('=') : std::string::npos;
      if (equals == std::string::npos) {
        r.configuration.push_back({item.name, value});
      } else {
        r.configuration.push_back({value.substr(0, equals), value.substr(equals + 1)});
      }
    }
  }
}

}  // namespace

TrainingReport report_of(const ReportInput& in, const Findings& findings) {
  TrainingReport r;
  const std::string name = in.options.dataset.filename().string();
  r.title =
      "SAR-NeRF of " + (name.empty() || name == "." ? in.folder.path().filename().string() : name);
  char text[200];
  std::snprintf(text, sizeof text,
                "%s, learned from %zu views in %lld steps and %.3g s, start-up included.",
                in.run.field_size().c_str(), in.data.training_views.size(),
                static_cast<long long>(in.trainer.steps_done()), in.run.trained_until_s());
  r.summary = text;
  r.trained = {{"dataset", in.options.dataset.string()},
               {"SHA-256 of the dataset", in.data.fingerprint},
               {"views learned from", std::to_string(in.data.training_views.size())},
               {"views held out", std::to_string(in.data.n_held_out)},
               {"field", std::string(in.run.field().kind()) + ", " + in.run.field_size()},
               {"loss", "mean square error of power (paper, eq. 31); over a ground, of bounded relative errors"}};
  if (!in.options.against.empty())
    r.trained.push_back(
        {"unseen views of", in.options.against.string() + ": " +
                                std::to_string(in.data.validation.size() - in.data.n_held_out)});
  if (in.data.dataset.quantity == Quantity::amplitude)
    r.trained.push_back({"quantity", "amplitudes, squared: power is what is learned and compared"});
  if (in.data.training_views.size() == 1)
    r.warnings.push_back("a single view says little of the scene's shape");
  add_scores(in, findings, r);
  add_despeckled(in, findings, r);
  add_curve(in, r);
  add_pictures(in, findings, r);
  for (const auto& [stage, seconds] : findings.times.stages) r.stages.push_back({stage, seconds});
  for (const auto& [what, why] : left_out(in.options, in.data)) r.left_out.push_back({what, why});
  add_configuration(in, r);
  r.machine = {{"processor", processor_name()},
               {"threads", std::to_string(in.options.shared.n_threads)},
               {"libraries", torch_text()},
               {"program", "sar_nerf_train " + std::string(kVersion)}};
  return r;
}

}  // namespace sarnerf::app
