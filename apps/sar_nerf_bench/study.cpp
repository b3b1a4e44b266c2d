// SPDX-License-Identifier: Apache-2.0
#include "study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "learning.h"
#include "nerf_common.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/nerf/trainer.h"
#include "torch_setup.h"

namespace sarnerf::bench {

const std::pair<std::string, double>* best_baseline(const LearningStudy& study) {
  const auto best =
      std::ranges::max_element(study.baselines, {}, &std::pair<std::string, double>::second);
  return best == study.baselines.end() ? nullptr : &*best;
}

std::vector<std::string> fields_of(const LearningStudy& study) {
  std::vector<std::string> fields;
  for (const LearningRun& run : study.runs) {
    if (std::ranges::find(fields, run.field) == fields.end()) fields.push_back(run.field);
  }
  return fields;
}

std::optional<double> seconds_to(const LearningRun& run, double psnr_db) {
  const LearningPoint* before = nullptr;
  for (const LearningPoint& p : run.points) {
    if (p.psnr_db >= psnr_db) {
      if (before == nullptr) return p.seconds;
      const double share = (psnr_db - before->psnr_db) / (p.psnr_db - before->psnr_db);
      return before->seconds * std::pow(p.seconds / before->seconds, share);
    }
    before = &p;
  }
  return std::nullopt;
}

std::optional<double> seconds_to(const LearningStudy& study, const std::string& field,
                                 double psnr_db) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::map<std::uint64_t, double> earliest_s;
  for (const LearningRun& run : study.runs) {
    if (run.field != field) continue;
    const double s = seconds_to(run, psnr_db).value_or(kNever);
    const auto [entry, is_new] = earliest_s.try_emplace(run.seed, s);
    if (!is_new) entry->second = std::min(entry->second, s);
  }
  if (earliest_s.empty()) return std::nullopt;
  std::vector<double> sorted;
  for (const auto& [seed, s] : earliest_s) sorted.push_back(s);
  std::ranges::sort(sorted);
  const std::size_t n = sorted.size();
  const double median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
  return median < kNever ? std::optional(median) : std::nullopt;
}

namespace {

/// From one score of a run to the next, its time grows by this factor at least.
constexpr double kScoreEvery = 1.25;

/// The training data.
struct Material {
  std::filesystem::path folder;
  Dataset dataset;
  std::vector<std::size_t> all;  ///< views of `dataset`

  TrainingSet read(const Monitor& monitor) const {
    std::vector<PosedImage> images = load_images(folder, dataset, all, monitor);
    if (!dataset.exact_poses) return app::registered_training_set(std::move(images), dataset.scene_box_m, {}, dataset.resolution, {}, monitor).set;
    return training_set(std::move(images), dataset.scene_box_m, {}, dataset.resolution);
  }
};

/// Up to `most` of `count` indices, spread by the golden ratio: evenly, but without a period. Equally spaced views
/// might all have the same distance from the training views, which are equally spaced themselves.
std::vector<std::size_t> scattered_indices(std::size_t count, std::size_t most) {
  std::set<std::size_t> places;
  for (double n = 0.0; places.size() < std::min(count, most); n += 1.0) {
    const double turns = (n + 0.5) * std::numbers::phi;
    places.insert(static_cast<std::size_t>((turns - std::floor(turns)) * static_cast<double>(count)));
  }
  return {places.begin(), places.end()};
}

std::vector<PosedImage> judged_views(const Options& o, const Dataset& dataset, app::Console& console,
                                     const Monitor& monitor) {
  const Dataset other = read_manifest(o.against);
  const std::string name = "--against " + o.against.string();
  if (glm::distance(dataset.aim_m, other.aim_m) > 1e-3 ||
      dataset.calibration != other.calibration)
    throw UsageError(name + ": shows another place, or is calibrated in another way, than " +
                     o.training.string() + "; use views of the same scene, aim and calibration");
  const std::vector<std::size_t> unseen = app::unseen_views(other.views, dataset.views);
  if (unseen.empty())
    throw UsageError(name + ": expected views that are not trained on, found none");
  std::vector<std::size_t> chosen;
  for (const std::size_t n : scattered_indices(unseen.size(), o.n_views))
    chosen.push_back(unseen[n]);
  std::vector<PosedImage> views = load_images(o.against, other, chosen, monitor);
  for (PosedImage& view : views) view.acquisition.aim_m = glm::dvec3(0.0);
  for (const Outlier& outlier : limit_outliers(views)) console.warning(outlier_text(outlier, views));
  return views;
}

std::string title_of(const LearningRun& run) {
  char text[80];
  std::snprintf(text, sizeof text, "%s, %g s, seed %llu", run.field.c_str(), run.planned_s,
                static_cast<unsigned long long>(run.seed));
  return text;
}

Trainer trainer_of(const std::string& field, TrainingSet set, std::uint64_t seed) {
  app::use_torch_threads(is_network(field) ? thread_count() : 1);
  TrainerOptions options = default_options(set, field, Schedule::clock);
  options.seed = seed;
  return Trainer(std::move(set), options);
}

LearningRun learn(LearningRun run, const Material& material, const Judge& judge,
                  const Loading& loading, app::Console& console, const Monitor& monitor) {
  const std::string title = title_of(run);
  WorkClock clock(loading.seconds, loading.cpu_seconds);
  Trainer trainer = trainer_of(run.field, material.read(monitor), run.seed);
  run.start_s = clock.seconds();
  double scored_s = 0.0, next_s = 0.0, step_s = 0.0;
  std::int64_t n_steps = 0;
  // At least one step: a field that has learned nothing is of no use.
  for (bool ended = false; !ended;) {
    const double before_s = clock.seconds();
    try {
      trainer.step(std::min(before_s / run.planned_s, std::nextafter(1.0, 0.0)));
    } catch (const NumericsError& e) {
      run.diverged = e.what();
      return run;
    }
    ++n_steps;
    step_s = clock.seconds() - before_s;
    ended = clock.seconds() + step_s >= run.planned_s;
    clock.stop();
    if (monitor.stop_requested())
      throw Interrupted("interrupted; the runs that had ended are saved");
    if (ended || clock.seconds() >= next_s) {
      const double begin_s = WorkClock::now_s();
      const double psnr_db = judge.psnr_db(
          [&](const Acquisition& view) { return render_view(trainer.field(), view); });
      if (std::isnan(psnr_db)) {
        run.diverged = "its views are not finite";
        return run;
      }
      run.points.push_back({clock.seconds(), clock.cpu_seconds(), n_steps, psnr_db});
      scored_s += WorkClock::now_s() - begin_s;
      next_s = std::max(kScoreEvery * clock.seconds(), run.start_s + scored_s);
    }
    char detail[60] = "";
    std::snprintf(detail, sizeof detail, "%.2f dB", run.points.back().psnr_db);
    console.progress(title, static_cast<std::uint64_t>(clock.seconds()),
                     static_cast<std::uint64_t>(std::ceil(run.planned_s)) + 1, detail);
    clock.go_on();
  }
  return run;
}

}  // namespace

double Judge::psnr_db(const std::function<Image<float>(const Acquisition&)>& render) const {
  double sum_db = 0.0;
  for (const PosedImage& view : views)
    sum_db += capped_psnr_db(render(view.acquisition), view.power, peak_power);
  return sum_db / static_cast<double>(views.size());
}

void study_learning(const Options& o, const Loading& loading, app::Console& console,
                    const Monitor& monitor,
                    const std::function<void(const LearningStudy&)>& finished) {
  Material material{o.training, read_manifest(o.training), {}};
  if (material.dataset.views.empty())
    throw InputError(o.training.string() + ": the dataset has no view to learn from");
  if (material.dataset.unfinished()) console.warning(o.training.string() + ": " + unfinished_text(material.dataset));
  material.all.resize(material.dataset.views.size());
  std::iota(material.all.begin(), material.all.end(), std::size_t{0});
  const TrainingSet set = material.read(monitor);
  for (const Outlier& outlier : set.outliers) console.warning(outlier_text(outlier, set.images));
  const Judge judge{judged_views(o, material.dataset, console, monitor), double{set.peak}};

  LearningStudy study;
  study.dataset = o.training.string();
  study.n_training_views = static_cast<int>(material.all.size());
  study.peak_power = judge.peak_power;
  for (const PosedImage& view : judge.views) study.views.push_back(view.name);
  EvaluationSettings settings;
  settings.peak_power = judge.peak_power;
  const Evaluation baselines = evaluate(judge.views, {}, set.images, settings, monitor);
  for (const MethodScores& method : baselines.baselines)
    study.baselines.emplace_back(method.name, method.mean.psnr_power_db);

  for (const auto& [field, times_s] : o.contest) {
    for (const double planned_s : times_s) {
      for (int seed = 1; seed <= o.n_seeds; ++seed) {
        LearningRun run;
        run.field = field;
        run.planned_s = planned_s;
        run.seed = static_cast<std::uint64_t>(seed);
        study.runs.push_back(learn(std::move(run), material, judge, loading, console, monitor));
        const LearningRun& ended = study.runs.back();
        if (!ended.diverged.empty()) {
          console.warning(title_of(ended) + ": " + ended.diverged);
        } else {
          char text[120];
          std::snprintf(text, sizeof text, "%s: %.2f dB after %.2f s and %lld steps",
                        title_of(ended).c_str(), ended.points.back().psnr_db,
                        ended.points.back().seconds,
                        static_cast<long long>(ended.points.back().step));
          console.note(text);
        }
        finished(study);
      }
    }
  }
}

}  // namespace sarnerf::bench
