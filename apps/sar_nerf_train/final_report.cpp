// SPDX-License-Identifier: Apache-2.0
#include "final_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>

#include "version.h"
#include <nlohmann/json.hpp>

#include "nerf_common.h"
#include "process.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/evaluation.h"
#include "torch_setup.h"
#include "values.h"

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

/// The images for the baselines: those that the field learned from. Where their poses are not exact, as they were registered to one
/// another before training, without the field's shifts and gains.
std::vector<PosedImage> baseline_images(const ReportInput& in) {
  return in.data.registered.empty() ? in.trainer.set().images : in.data.registered;
}

/// Each picture shows a single view, its despeckled truth, the prediction, the best baseline, and the prediction's
/// difference from the truth. It is the difference of amplitudes, with full colour at an eighth of the largest
/// amplitude: differences of power would show only single glints.
void write_despeckled_pictures(const ReportInput& in, const Findings& findings,
                               std::span<const PosedImage> training, std::span<const Baseline> baselines) {
  const MethodScores* const best = findings.despeckled->best_baseline();
  if (best == nullptr) return;
  const auto baseline = std::find_if(baselines.begin(), baselines.end(),
                                     [&](const Baseline& b) { return name(b) == best->name; });
  const DespeckledTruth& truth = *in.data.despeckled;
  const std::size_t n = std::min(truth.views.size(), kDespeckledPictures);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t t = k * truth.views.size() / n, v = truth.which[t];
    const Image<float>&mean = truth.views[t].power, &prediction = findings.predictions[v];
    const Image<float> other = baseline_view(training, truth.views[t].acquisition, *baseline);
    write_picture(in, "despeckled", v, {&in.data.validation[v].power, &mean, &prediction, &other}, amplitudes(mean),
                  amplitudes(prediction), 0.5f * std::sqrt(in.trainer.set().peak));
  }
}

/// Scores the predictions, and writes the pictures of despeckled views, which include the best baseline.
void judge(const ReportInput& in, Findings& findings, const Monitor& monitor) {
  EvaluationSettings settings;
  settings.peak_power = double{in.trainer.set().peak};
  findings.lpips_missing = lpips_missing(in.options.lpips, in.data.validation);
  if (findings.lpips_missing.empty()) {
    settings.lpips = in.lpips;
    use_torch_threads(in.options.shared.n_threads);
  }
  const std::vector<PosedImage> training = baseline_images(in);
  settings.baselines = default_baselines(training, monitor);
  findings.evaluation =
      evaluate(in.data.validation, findings.predictions, training, settings, monitor);
  if (in.data.despeckled) {
    settings.oracle_registered = !in.data.dataset.exact_poses;
    findings.despeckled = evaluate_despeckled(*in.data.despeckled, findings.predictions, training,
                                              settings, monitor);
    write_despeckled_pictures(in, findings, training, *settings.baselines);
  }
}

/// The shifts of the training views, where they were learned.
Json registration_json(const Trainer& trainer) {
  if (trainer.options().n_registrations == 0) return {};
  Json views = Json::array();
  double squares = 0.0;
  for (const PosedImage& image : trainer.set().images) {
    const Acquisition& a = image.acquisition;
    squares += std::pow(a.azimuth_shift_m / a.azimuth_spacing_m, 2) + std::pow(a.range_shift_m / a.range_spacing_m, 2);
    views.push_back({{"image", image.name}, {"azimuth_m", a.azimuth_shift_m}, {"range_m", a.range_shift_m}});
  }
  return {{"rms_pixels", std::sqrt(0.5 * squares / static_cast<double>(views.size()))}, {"views", std::move(views)}};
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
  if (!in.data.field_choice.empty()) j["field"]["chosen"] = in.data.field_choice;
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
  j["registration"] = registration_json(in.trainer);
  j["evaluation"] = findings.evaluation ? evaluation_json(*findings.evaluation) : Json();
  if (findings.despeckled) j["despeckled"] = evaluation_json(*findings.despeckled);
  if (!findings.lpips_missing.empty()) j["lpips_missing"] = findings.lpips_missing;
  return j.dump(2) + "\n";
}

/// ", 36 unseen views at 48.12 dB, 7.90 dB above 'nearest view'": PSNR of power.
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
  for (const std::size_t n : spread_indices(in.data.validation.size(), kMostPictures)) {
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
  for (const std::size_t n : spread_indices(images.size(), kPicturesOfTraining)) {
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
               {"loss", loss_text(in.trainer.set(), in.trainer.options())}};
  if (!in.data.field_choice.empty()) r.trained.push_back({"field chosen", in.data.field_choice});
  if (!in.options.against.empty())
    r.trained.push_back(
        {"unseen views of", in.options.against.string() + ": " +
                                std::to_string(in.data.validation.size() - in.data.n_held_out)});
  if (in.data.dataset.quantity == Quantity::amplitude)
    r.trained.push_back({"quantity", "amplitudes, squared: power is what is learned and compared"});
  if (in.data.training_views.size() == 1)
    r.warnings.push_back("a single view hardly constrains the scene's shape");
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

namespace {

std::string sizes_text(const std::vector<DatasetView>& views) {
  std::set<std::pair<int, int>> sizes;
  for (const DatasetView& v : views) sizes.insert({v.n_azimuth, v.n_range});
  const auto text = [](const std::pair<int, int>& s) {
    return std::to_string(s.first) + " x " + std::to_string(s.second);
  };
  return sizes.size() == 1 ? text(*sizes.begin())
                           : text(*sizes.begin()) + " to " + text(*sizes.rbegin()) + ", " +
                                 std::to_string(sizes.size()) + " sizes";
}

/// What the images show around the scene, and the consequence for training.
std::string background_text(const TrainingSet& set) {
  if (set.tails_are_dark) return "tails of an impulse response, 40 dB below the brightest pixel: taken for dark";
  if (!set.ground)
    return set.background ? "returns power, but is no level ground: nothing is carved"
                                      : "dark: what lies in front of the first returns is empty";
  const GroundEstimate& ground = *set.ground;
  const double noise = ground.plane->noise, mean = ground.plane->mean_power();
  return format("level ground%s%s, %.3g m %s the aim point, bare in %.0f %% of the pixels: rays end on it, "
                "objects may be up to %.3g m high%s",
                ground.speckled ? " under speckle" : "",
                noise > 0.0 && mean > 0.0 ? format(", with noise %.1f dB below it", 10.0 * std::log10(mean / noise)).c_str() : "",
                std::abs(ground.plane->height_m),
                ground.plane->height_m < 0.0 ? "below" : "above", 100.0 * ground.part_of_pixels(),
                set.box_m.max.y - ground.plane->height_m, ground.speckled ? " (--scene-height)" : "");
}

}  // namespace

std::vector<std::pair<std::string, std::string>> left_out(const Options& o, const Data& data) {
  std::vector<std::pair<std::string, std::string>> list;
  if (data.validation.empty()) {
    list.emplace_back("held-out PSNR, baselines",
                      !o.against.empty() ? "all views of --against are trained on"
                      : o.holdout.kind == Holdout::Kind::automatic
                          ? "fewer than 48 views: all are learned from (--holdout, --against)"
                          : "no view is held out (--holdout, --against)");
  }
  if (o.patience > 0.0 && data.validation.empty())
    list.emplace_back("early end", "needs held-out views (--holdout, --against)");
  if (o.lpips.empty()) list.emplace_back("LPIPS", "no weights given (--lpips FILE, docs/guide/lpips.md)");
  if (o.field == "paper") {
    list.emplace_back("rays that miss the scene's box, and samples outside of it", "the paper samples the box alone");
    list.emplace_back("ground, impulse response, shifts of views", "the method of the paper has none of them");
    return list;
  }
  list.emplace_back("azimuth rows without occupied voxels", "neither rendered nor learned from: they contribute nothing");
  list.emplace_back(
      "empty space",
      "voxels that carving or pruning finds empty, and those outside of all swaths");
  return list;
}

std::string explain(const Options& o, const Data& data, const Trainer& trainer) {
  std::string text = "plan\n";
  const auto line = [&](const std::string& name, const std::string& value) {
    text += "  " + name + std::string(name.size() < 18 ? 18 - name.size() : 1, ' ') + value + "\n";
  };
  line("learned from", std::to_string(data.training_views.size()) + " views of " +
                           o.dataset.string() + ", " + sizes_text(data.training_views) +
                           " pixels (azimuth x range)");
  line("predicted", data.validation.empty()
                        ? "none"
                        : std::to_string(data.n_held_out) + " held out, " +
                              std::to_string(data.validation.size() - data.n_held_out) +
                              " of --against");
  line("field",
       std::string(trainer.field().kind()) + ", to begin with " + trainer.field().size_text());
  if (!data.field_choice.empty()) line("chosen", data.field_choice);
  if (o.field != "paper") line("background", background_text(trainer.set()));
  if (trainer.set().resolution)
    line("impulse response", resolution_text(*trainer.set().resolution) +
                                 (trainer.set().deconvolved.empty() ? ": applied to rendered views and, transposed, to the gradients"
                                                                : ": images are deconvolved; it is applied to rendered views"));
  if (o.field != "paper" && !trainer.set().resolution && o.resolution.or_else(data.dataset.resolution))
    line("impulse response", "left out: fewer than six speckled views do not determine a ground, or the spacing is too coarse for it");
  line("loss", loss_text(trainer.set(), trainer.options()));
  line("until", o.time_s ? format("%.4g s after the program's start", *o.time_s)
                         : std::to_string(o.steps) + " steps");
  line("a step", std::to_string(trainer.options().rows_per_step) + " azimuth rows of all views");
  std::uint64_t bytes = 0;
  for (const PosedImage& image : trainer.set().images) bytes += 4 * image.power.pixels().size();
  for (const PosedImage& image : data.validation) bytes += 4 * image.power.pixels().size();
  line("images", bytes_text(bytes) + " in memory");
  line("threads", std::to_string(o.shared.n_threads));
  for (const auto& [what, why] : left_out(o, data)) line("left out", what + ": " + why);
  line("output", o.run.string() + "/");
  text.pop_back();
  return text;
}

}  // namespace sarnerf::app
