// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/evaluation.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/posed_image.h"
#include "view_interpolation.h"

namespace sarnerf {

Image<float> amplitude_of(const Image<float>& power) {
  Image<float> root(power.n_azimuth(), power.n_range());
  for (std::size_t n = 0; n < root.pixels().size(); ++n) {
    root.pixels()[n] = std::sqrt(std::max(0.0f, power.pixels()[n]));
  }
  return root;
}

namespace {

/// Mean of `value` over the elements that have one; none if no element has one.
template <class T, class Value>
std::optional<double> mean_of_present(std::span<const T> all, Value&& value) {
  double sum = 0.0;
  int count = 0;
  for (const T& one : all) {
    const std::optional<double> v = value(one);
    if (!v) continue;
    sum += *v;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

Scores mean_of(std::span<const Scores> views) {
  const auto mean = [&](auto member) {
    return mean_of_present(views, [&](const Scores& s) { return std::optional<double>(s.*member); });
  };
  Scores means{mean(&Scores::psnr_power_db).value_or(0.0),
               mean(&Scores::psnr_amplitude_db).value_or(0.0),
               mean(&Scores::psnr_target_power_db),
               mean(&Scores::ssim_power).value_or(0.0),
               mean(&Scores::lpips),
               {},
               {}};
  std::vector<BackgroundScores> background;
  for (const Scores& s : views) {
    if (s.background) background.push_back(*s.background);
  }
  if (!background.empty()) means.background = mean_of(background);
  if (!views.empty() && views.front().registered) {
    RegisteredScores& registered = means.registered.emplace();
    const auto n = static_cast<double>(views.size());
    for (const Scores& s : views) {
      registered.psnr_power_db += s.registered->psnr_power_db / n;
      registered.psnr_amplitude_db += s.registered->psnr_amplitude_db / n;
    }
  }
  return means;
}

void check_counts(std::span<const PosedImage> truth, std::span<const Image<float>> predictions,
                  std::span<const PosedImage> training, const EvaluationSettings& settings) {
  if (truth.empty()) throw UsageError("an evaluation needs at least one view to compare with");
  if (!predictions.empty() && predictions.size() != truth.size()) {
    throw UsageError("an evaluation needs one prediction a view: " + std::to_string(truth.size()) +
                     " views, " + std::to_string(predictions.size()) + " predictions");
  }
  for (const Bound& bound : settings.bounds) {
    if (bound.images.size() == truth.size()) continue;
    throw UsageError("the bound '" + bound.name + "' needs one image a view: " +
                     std::to_string(truth.size()) + " views, " +
                     std::to_string(bound.images.size()) + " images");
  }
  if (training.empty() && !settings.peak_power) {
    throw UsageError("an evaluation without training images needs the peak that PSNR refers to");
  }
  if (training.empty() && settings.baselines && !settings.baselines->empty()) {
    throw UsageError("baselines are made of the training images; there is none");
  }
}

/// The data common to all methods of one evaluation.
struct Judge {
  std::span<const PosedImage> truth;
  double peak;
  const EvaluationSettings& settings;
  bool with_background;
  const Monitor& monitor;
  std::uint64_t n_total;
  std::uint64_t n_done = 0;
  std::mutex done_mutex{};

  void done() {
    const std::scoped_lock lock(done_mutex);
    monitor.report("evaluate", ++n_done, n_total);
  }

  /// `image_of(n)` is the prediction of view n; it may be computed at each call.
  template <class ImageOf>
  MethodScores scores(std::string name, ImageOf&& image_of) {
    MethodScores method{std::move(name), std::vector<Scores>(truth.size()), {}, 0};
    parallel_for(truth.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) {
        monitor.check();
        const Image<float>& image = image_of(n);
        method.views[n] = score_view(image, truth[n], peak, settings.target);
        if (with_background)
          method.views[n].background = score_background(image, truth[n], peak, settings.background);
        if (settings.oracle_registered) method.views[n].registered = score_registered(image, truth[n], peak);
        done();
      }
    });
    // Images are computed again rather than kept: an LPIPS network costs far more than an interpolation.
    for (std::size_t n = 0; settings.lpips && n < truth.size(); ++n) {
      monitor.check();
      method.views[n].lpips = settings.lpips(image_of(n), truth[n].power, peak);
      done();
    }
    method.mean = mean_of(method.views);
    method.n_capped = static_cast<int>(
        std::count_if(method.views.begin(), method.views.end(),
                      [](const Scores& s) { return s.psnr_power_db == kMostPsnr_db; }));
    return method;
  }
};

}  // namespace

double peak_power(std::span<const PosedImage> images) {
  float peak = 0.0f;
  for (const PosedImage& image : images) {
    for (const float p : image.power.pixels()) peak = std::max(peak, p);
  }
  if (!(peak > 0.0f)) {
    throw InputError("all " + std::to_string(images.size()) +
                     " training images are blank: there is no peak that PSNR could refer to; check "
                     "the scene and the swath");
  }
  return double(peak);
}

const MethodScores* Evaluation::best_baseline() const {
  const auto best = std::max_element(
      baselines.begin(), baselines.end(),
      [](const auto& a, const auto& b) { return a.mean.psnr_power_db < b.mean.psnr_power_db; });
  return best == baselines.end() ? nullptr : &*best;
}

std::optional<double> Evaluation::margin_db() const {
  const MethodScores* best = best_baseline();
  if (!prediction || best == nullptr) return std::nullopt;
  return prediction->mean.psnr_power_db - best->mean.psnr_power_db;
}

Scores score_view(const Image<float>& power, const PosedImage& truth, double peak,
                  const TargetRule& target) {
  if (power.n_azimuth() != truth.power.n_azimuth() || power.n_range() != truth.power.n_range()) {
    throw UsageError("the predicted image of " + truth.name + " has " +
                     std::to_string(power.n_azimuth()) + " x " + std::to_string(power.n_range()) +
                     " pixels, the truth " + std::to_string(truth.power.n_azimuth()) + " x " +
                     std::to_string(truth.power.n_range()));
  }
  for (const float p : power.pixels()) {
    if (std::isfinite(p)) continue;
    throw NumericsError("the predicted image of " + truth.name +
                        " holds values that are not finite; the field that made it has diverged");
  }
  Scores scores;
  scores.psnr_power_db = capped_psnr_db(power, truth.power, peak);
  scores.psnr_amplitude_db =
      capped_psnr_db(amplitude_of(power), amplitude_of(truth.power), std::sqrt(peak));
  const auto over_target =
      masked_psnr_db(power, truth.power, peak, target_mask(truth.power, target));
  if (over_target) scores.psnr_target_power_db = std::min(*over_target, kMostPsnr_db);
  scores.ssim_power = ssim(power, truth.power, peak);
  return scores;
}

Evaluation evaluate(std::span<const PosedImage> truth, std::span<const Image<float>> predictions,
                    std::span<const PosedImage> training, const EvaluationSettings& settings,
                    const Monitor& monitor) {
  check_counts(truth, predictions, training, settings);
  const std::vector<Baseline> baselines =
      settings.baselines ? *settings.baselines : default_baselines(training, monitor);
  Evaluation evaluation;
  evaluation.peak_power = settings.peak_power ? *settings.peak_power : peak_power(training);
  evaluation.target = settings.target;
  for (const PosedImage& view : truth) {
    evaluation.views.push_back(
        {view.name, view.acquisition.azimuth_rad, view.acquisition.incidence_rad});
  }

  const std::size_t n_methods =
      baselines.size() + settings.bounds.size() + (predictions.empty() ? 0 : 1);
  const bool with_background = has_visible_background(truth);
  if (with_background) evaluation.background = settings.background;
  Judge judge{truth, evaluation.peak_power, settings, with_background, monitor,
              n_methods * truth.size() * (settings.lpips ? 2 : 1)};
  if (!predictions.empty()) {
    evaluation.prediction = judge.scores(
        "prediction", [&](std::size_t n) -> const Image<float>& { return predictions[n]; });
  }
  for (const Baseline& b : baselines) {
    evaluation.baselines.push_back(judge.scores(name(b), [&](std::size_t n) {
      return baseline_view(training, truth[n].acquisition, b);
    }));
  }
  for (const Bound& bound : settings.bounds) {
    evaluation.bounds.push_back(judge.scores(
        bound.name, [&](std::size_t n) -> const Image<float>& { return bound.images[n]; }));
  }
  return evaluation;
}

namespace {

std::optional<double> scatterer_error_m(const Image<float>& power, const PosedImage& truth,
                                        double floor, const BackgroundRule& rule) {
  const Acquisition& a = truth.acquisition;
  const MaximaRule maxima{rule.n_scatterers, rule.separation_m, a.azimuth_spacing_m,
                          a.range_spacing_m};
  const auto expected = strongest_maxima(truth.power, floor, maxima);
  if (expected.empty()) return std::nullopt;
  const auto found = strongest_maxima(power, 0.0, maxima);
  if (found.empty())
    return std::hypot(a.n_azimuth * a.azimuth_spacing_m, a.n_range * a.range_spacing_m);
  return mean_distance_m(expected, found, maxima);
}

}  // namespace

BackgroundScores score_background(const Image<float>& power, const PosedImage& truth, double peak,
                                  const BackgroundRule& rule) {
  BackgroundScores scores;
  const double error_db = log_amplitude_error_db(power, truth.power, peak, rule.range_db);
  scores.log_amplitude_error_db = error_db;
  scores.log_amplitude_psnr_db =
      error_db > 0.0 ? std::min(kMostPsnr_db, 20.0 * std::log10(rule.range_db / error_db))
                     : kMostPsnr_db;
  const auto expected = find_regions(truth.power, rule.regions);
  if (!expected) return scores;
  scores.looks = equivalent_looks(power, rule.looks, &expected->background);
  scores.looks_of_truth = equivalent_looks(truth.power, rule.looks, &expected->background);

  Regions found{0.0, Image<std::uint8_t>(power.n_azimuth(), power.n_range()), {}, {}};
  found.shadow = found.target;
  if (auto regions = find_regions(power, rule.regions)) found = std::move(*regions);
  scores.target_iou = intersection_over_union(found.target, expected->target);
  scores.shadow_iou = intersection_over_union(found.shadow, expected->shadow);

  const double floor = expected->background_power * std::pow(10.0, 0.1 * rule.regions.target_db);
  scores.scatterer_error_m = scatterer_error_m(power, truth, floor, rule);
  return scores;
}

BackgroundScores mean_of(std::span<const BackgroundScores> views) {
  if (views.empty()) throw UsageError("a mean over views needs at least one view");
  const auto mean = [&](auto member) {
    return mean_of_present(views, [&](const BackgroundScores& s) { return std::optional<double>(s.*member); });
  };
  const auto harmonic_mean = [&](auto member) -> std::optional<double> {
    const auto fluctuation = mean_of_present(views, [&](const BackgroundScores& s) {
      return s.*member ? std::optional(1.0 / *(s.*member)) : std::nullopt;
    });
    if (!fluctuation) return std::nullopt;
    return 1.0 / *fluctuation;
  };
  using S = BackgroundScores;
  return {*mean(&S::log_amplitude_error_db), *mean(&S::log_amplitude_psnr_db),
          harmonic_mean(&S::looks),          harmonic_mean(&S::looks_of_truth),
          mean(&S::target_iou),              mean(&S::shadow_iou),
          mean(&S::scatterer_error_m)};
}

namespace {

/// Every other view of the sorted ones, from index `first` on.
std::vector<const PosedImage*> every_other(Views sorted, std::size_t first) {
  std::vector<const PosedImage*> some;
  for (std::size_t n = first; n < sorted.size(); n += 2) some.push_back(sorted[n]);
  return some;
}

std::vector<Neighbour> within(Views views, const Acquisition& wanted, double reach_rad) {
  // Views exactly at the limit are included, however their angle was rounded.
  const double limit = reach_rad + 1e-9;
  std::vector<Neighbour> near;
  for (const PosedImage* view : views) {
    const double turn = view->acquisition.azimuth_rad - wanted.azimuth_rad;
    if (std::abs(std::remainder(turn, 2.0 * kPi)) <= limit) near.push_back({view, 0.0});
  }
  for (Neighbour& n : near) n.weight = 1.0 / double(near.size());
  return near;
}

}  // namespace

DespeckledTruth despeckled_truth(std::span<const PosedImage> unseen, double reach_rad) {
  if (!(reach_rad > 0.0 && reach_rad < kPi)) {
    throw UsageError("views are averaged over less than half a turn to both sides; asked for " +
                     std::to_string(deg_from_rad(reach_rad)) + " degrees");
  }
  DespeckledTruth result;
  if (unseen.empty()) return result;
  for (Pitch& pitch : pitches(checked_views(unseen))) {
    std::stable_sort(pitch.views.begin(), pitch.views.end(),
                     [](const PosedImage* a, const PosedImage* b) {
                       return a->acquisition.azimuth_rad < b->acquisition.azimuth_rad;
                     });
    const auto odd = every_other(pitch.views, 0), even = every_other(pitch.views, 1);
    for (const PosedImage* view : odd) {
      Acquisition wanted = view->acquisition;
      wanted.azimuth_shift_m = wanted.range_shift_m = 0.0;
      const auto of_truth = within(odd, wanted, reach_rad), others = within(even, wanted, reach_rad);
      if (of_truth.size() < 2 || others.empty()) continue;
      result.which.push_back(static_cast<std::size_t>(view - unseen.data()));
      result.views.push_back(
          {view->name, wanted, weighted_mean(of_truth, wanted, Warp::turn, 0.0)});
      result.true_neighbours.push_back(weighted_mean(others, wanted, Warp::turn, 0.0));
    }
  }
  return result;
}

Evaluation evaluate_despeckled(const DespeckledTruth& truth,
                               std::span<const Image<float>> predictions,
                               std::span<const PosedImage> training, EvaluationSettings settings,
                               const Monitor& monitor) {
  std::vector<Image<float>> of_truth;
  if (!predictions.empty()) {
    for (const std::size_t n : truth.which) {
      if (n >= predictions.size()) {
        throw UsageError("a despeckled truth needs predictions of all views that it was made of; " +
                         std::to_string(predictions.size()) + " are too few");
      }
      of_truth.push_back(predictions[n]);
    }
  }
  Bound blurred{"true neighbours, blurred by 1", {}};
  for (const Image<float>& image : truth.true_neighbours)
    blurred.images.push_back(gaussian_blur(image, 1.0));
  settings.bounds.push_back({"true neighbours", truth.true_neighbours});
  settings.bounds.push_back(std::move(blurred));
  return evaluate(truth.views, of_truth, training, settings, monitor);
}

}  // namespace sarnerf
