// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf {

namespace {

template <class Options, class Visit>
void for_each_grid_option(Options& o, Visit&& visit) {
  visit("voxel_size_m", o.voxel_size_m);
  visit("n_levels", o.n_levels);
  visit("level_steps", o.level_steps);
  visit("refine_steps_left", o.refine_steps_left);
  visit("harmonics_degree", o.harmonics_degree);
  visit("density_rate", o.density_rate);
  visit("source_rate", o.source_rate);
  visit("initial_depth", o.initial_depth);
  visit("initial_brightness", o.initial_brightness);
  visit("prune_from", o.prune_from);
  visit("prune_depth", o.prune_depth);
  visit("prune_exposure", o.prune_exposure);
  visit("n_prunings", o.n_prunings);
  visit("brightness_decay", o.brightness_decay);
  visit("final_brightness_decay", o.final_brightness_decay);
  visit("smooth_density", o.smooth_density);
  visit("smooth_source", o.smooth_source);
  visit("smooth_angular", o.smooth_angular);
}

template <class Options, class Visit>
void for_each_mlp_option(Options& o, Visit&& visit) {
  visit("depth", o.shape.depth);
  visit("width", o.shape.width);
  visit("skip", o.shape.skip);
  visit("position_frequencies", o.shape.position_frequencies);
  visit("direction_frequencies", o.shape.direction_frequencies);
  visit("voxel_size_m", o.voxel_size_m);
  visit("rate", o.rate);
  visit("warm_up_steps", o.warm_up_steps);
  visit("initial_depth", o.initial_depth);
  visit("initial_brightness", o.initial_brightness);
  visit("prune_depth", o.prune_depth);
  visit("refresh_steps", o.refresh_steps);
  visit("integrator", o.integrator);
}

/// Calls visit(name, member) for every option that concerns the field.
template <class Options, class Visit>
void for_each_option(Options& o, Visit&& visit) {
  visit("field", o.field);
  if (o.field == "mlp")
    for_each_mlp_option(o.mlp, visit);
  else
    for_each_grid_option(o.grid, visit);
  visit("rows_per_step", o.rows_per_step);
  visit("ray_spacing", o.ray_spacing);
  visit("most_ray_spacing_bins", o.most_ray_spacing_bins);
  visit("longest_segment", o.longest_segment);
  visit("end_depth", o.end_depth);
  visit("final_rate", o.final_rate);
  visit("distortion", o.distortion);
  visit("final_distortion", o.final_distortion);
  visit("relative_epsilon", o.relative_epsilon);
  visit("huber_delta", o.huber_delta);
  visit("n_registrations", o.n_registrations);
  visit("seed", o.seed);
}

/// Options of older versions, and what stands in their place.
const std::map<std::string, std::string> kReplaced = {{"speckle_floor", "relative_epsilon"}, {"speckle_most", "huber_delta"}};

/// By the clock, a step with voxels of half the size takes as long as some four of before.
constexpr int kClockStepsLeft = 300;

/// Incidences this far apart (rad) see a scene's heights from so different sides that fog and false surfaces show.
constexpr double kIncidencesDiffer = 5.0 * std::numbers::pi / 180.0;

/// Fewer images leave so much open that decay darkens what they cannot place.
constexpr std::size_t kLeastForSurfaces = 36;

bool images_tell_surfaces(const TrainingSet& set) {
  if (set.images.size() < kLeastForSurfaces || set.background) return false;
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const PosedImage& image : set.images) {
    least = std::min(least, image.acquisition.incidence_rad);
    most = std::max(most, image.acquisition.incidence_rad);
  }
  return most - least > kIncidencesDiffer;
}

/// Fog so thin that rays see all of it, and a reason to become opaque: matter grows where all views agree, and not
/// where the first ones put it.
void learn_surfaces(GridOptions& grid, bool several_incidences) {
  grid.initial_depth = 0.02;
  grid.prune_depth = 0.002;
  grid.brightness_decay = several_incidences ? 1.0 : 0.7;
}

/// Views times looks_of() that the priors under speckle were chosen for: 72 views of one look, which looks_of() takes for
/// two where an impulse response makes neighbours alike.
constexpr double kViewsTimesLooks = 144.0;

/// Epsilon of the relative loss: the error that speckle explains falls with the looks, what the field misses does not.
constexpr double kEpsilonPerLook = 0.5, kMostEpsilon = 3.2;

/// Priors where errors come back through an impulse response, which averages them over its width.
constexpr double kThroughResponse = 0.4;

/// Errors in proportion to brightness, thin fog, learning rates at which speckle averages out, and priors that it does
/// not pass: in inverse proportion to what there is to average, and where that is little, to its root: few views show turning
/// brightness in coarse steps, which strong priors level. Measured on a truck and an L-shaped building of one and
/// four looks, and on measured chips, which glint (docs/method/learning.md).
void learn_over_ground(TrainerOptions& options, const TrainingSet& set) {
  const double looks = set.ground->looks.value_or(1.0);
  options.relative_epsilon = std::min(kMostEpsilon, kEpsilonPerLook * looks);
  options.huber_delta = 3.0;
  options.ray_spacing = 1.0;
  options.final_rate = 0.05;
  options.grid.initial_depth = 0.1;
  options.grid.source_rate = 0.03;
  const double n_looks = static_cast<double>(set.images.size()) * looks;
  const double lack = std::min(kViewsTimesLooks / n_looks, 5.0), scarcity = std::min(lack, std::sqrt(lack));
  options.grid.smooth_density = std::max(options.grid.smooth_density, 1e-2 * scarcity);
  options.grid.smooth_source = 1.0 * scarcity;
  options.grid.smooth_angular = 4.0 * scarcity / looks;
  if (set.resolution && set.deconvolved.empty()) options = with_smoothness(options, kThroughResponse);
}

}  // namespace

TrainerOptions default_options(const TrainingSet& set, const std::string& field, Schedule schedule,
                               std::optional<bool> surfaces) {
  TrainerOptions options;
  if (schedule == Schedule::clock) options.grid.refine_steps_left = kClockStepsLeft;
  options.field = field;
  double bin_m = std::numeric_limits<double>::infinity();
  for (const PosedImage& image : set.images) bin_m = std::min(bin_m, image.acquisition.range_spacing_m);
  options.grid.voxel_size_m = 2.0 / 3.0 * bin_m;
  // Few views leave more open than many: what they do not say, priors must. Measured on 72 to 12 views of three
  // solids (docs/method/learning.md).
  const double fewness = std::clamp(36.0 / static_cast<double>(std::max<std::size_t>(1, set.images.size())), 1.0, 3.0);
  options.distortion *= fewness;
  options.grid.smooth_density *= fewness;
  if (fewness > 1.2) {
    options.grid.smooth_angular = 1e-3;
    options.grid.initial_depth = 0.2;
    options.final_distortion = 0.05;
  }
  if (!set.exact_poses) options.n_registrations = 12;
  if (set.ground) learn_over_ground(options, set);
  if (set.background && !set.ground) {
    // Nothing is carved. Matter grows out of thin air over a plane, and what does not grow goes later.
    options.grid.initial_depth = 0.01;
    options.grid.n_levels = 3;
    options.rows_per_step = 70;
    options.grid.prune_from = 0.2;
  }
  const bool told = images_tell_surfaces(set);
  if (surfaces.value_or(told)) learn_surfaces(options.grid, told);
  options.mlp.voxel_size_m = bin_m;
  options.mlp.shape.position_frequencies = suitable_frequencies(set.box_m, bin_m);
  if (field == "mlp") {
    options.rows_per_step = 10;
    options.ray_spacing = 1.0;
    options.end_depth = 7.0;
    options.final_rate = 0.1;
    options.distortion = 0.0;
  }
  return options;
}

std::int64_t default_steps(const TrainingSet& set) { return set.ground ? 600 : 1000; }

std::string options_json(const TrainerOptions& options) {
  Json json = Json::object();
  for_each_option(options, [&](const char* name, const auto& value) { json[name] = value; });
  return json.dump();
}

void refuse_replaced_option(const std::string& name) {
  const auto replaced = kReplaced.find(name);
  if (replaced != kReplaced.end())
    throw UsageError("training option '" + name + "' is of an older version: use " + replaced->second);
}

TrainerOptions options_from_json(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) throw UsageError("training options must be a JSON object, found: " + text.substr(0, 80));
  TrainerOptions options;
  // Which options there are depends on the field.
  if (json.contains("field") && json.at("field").is_string()) options.field = json.at("field").get<std::string>();
  std::size_t n_known = 0;
  for_each_option(options, [&](const char* name, auto& value) {
    if (!json.contains(name)) return;
    ++n_known;
    try {
      value = json.at(name).get<std::decay_t<decltype(value)>>();
    } catch (const nlohmann::json::exception&) {
      throw UsageError(std::string("training option '") + name + "' cannot be " + json.at(name).dump());
    }
  });
  if (n_known < json.size()) {
    for (const auto& entry : json.items()) {
      bool known = false;
      for_each_option(options, [&](const char* name, auto&) { known |= entry.key() == name; });
      if (known) continue;
      refuse_replaced_option(entry.key());
      throw UsageError("'" + entry.key() + "' is no training option of the field '" + options.field + "'");
    }
  }
  return options;
}

void add_trainer_json(Archive& archive, const TrainerJson& trainer) {
  add_text(archive, "trainer",
           {{"options", Json::parse(trainer.options)}, {"steps", trainer.steps}, {"least_error", trainer.least_error}});
}

TrainerJson trainer_json(const Archive& archive, const std::string& where) {
  const Json text = text_of(archive, "trainer", where);
  const Json options = member<Json>(text, "options", where);
  const Json& least = text.contains("least_error") ? text.at("least_error") : Json();
  // JSON has no infinity: nothing was learned yet.
  return {options.dump(), member<std::int64_t>(text, "steps", where),
          least.is_number() ? least.get<double>() : std::numeric_limits<double>::infinity()};
}

namespace {

constexpr double kFactor = 3.0;
constexpr int kFarthest = 3;  ///< powers of the factor, either way
constexpr std::size_t kHeldOutOf = 6;

struct Parts {
  TrainingSet learned;
  std::vector<PosedImage> held_out;
};

/// Every sixth view in the order of azimuth, so that each pitch loses some.
Parts parts_of(const TrainingSet& set) {
  std::vector<std::size_t> order(set.images.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto azimuth = [&](std::size_t v) { return set.images[v].acquisition.azimuth_rad; };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return azimuth(a) < azimuth(b); });
  Parts parts;
  TrainingSet& learned = parts.learned;
  learned = set;
  learned.images.clear();
  learned.deconvolved.clear();
  if (learned.ground) {
    learned.ground->gain.clear();
    learned.ground->mask.clear();
  }
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::size_t v = order[n];
    if (n % kHeldOutOf == kHeldOutOf / 2) {
      parts.held_out.push_back(set.images[v]);
      continue;
    }
    learned.images.push_back(set.images[v]);
    if (!set.deconvolved.empty()) learned.deconvolved.push_back(set.deconvolved[v]);
    if (!set.ground) continue;
    learned.ground->gain.push_back(set.ground->gain[v]);
    learned.ground->mask.push_back(set.ground->mask[v]);
  }
  return parts;
}

double deviance(double seen, double predicted) {
  const double ratio = seen / predicted;
  return ratio - 1.0 - std::log(ratio);
}

double loss_of(const LearnedField& field, const Parts& parts, const TrainerOptions& options) {
  const TrainingSet& set = parts.learned;
  const bool speckled = set.ground && set.ground->speckled && options.relative_epsilon > 0.0;
  const double floor = speckled ? options.relative_epsilon * set.ground->plane->mean_power() : 0.0;
  double total = 0.0;
  std::size_t n = 0;
  for (const PosedImage& image : parts.held_out) {
    const Image<float> predicted = render_view(field, image.acquisition);
    for (std::size_t p = 0; p < predicted.pixels().size(); ++p, ++n) {
      const double seen = double{image.power.pixels()[p]}, mean = std::max(0.0, double{predicted.pixels()[p]});
      const double error = (mean - seen) / double{set.peak};
      total += speckled ? deviance(seen + floor, mean + floor) : error * error;
    }
  }
  return total / static_cast<double>(std::max<std::size_t>(1, n));
}

}  // namespace

TrainerOptions with_smoothness(TrainerOptions options, double factor) {
  options.grid.smooth_density *= factor;
  options.grid.smooth_source *= factor;
  options.grid.smooth_angular *= factor;
  return options;
}

SmoothnessChoice choose_smoothness(const TrainingSet& set, const TrainerOptions& options, std::int64_t n_steps,
                                   const Monitor& monitor) {
  if (options.field != "grid")
    throw UsageError("smoothness is chosen for the field grid; the field " + options.field + " has no such weights");
  if (set.images.size() < kHeldOutOf)
    throw UsageError("to choose the smoothness by validation takes 6 views or more, found " + std::to_string(set.images.size()));
  const Parts parts = parts_of(set);
  const auto trial = [&](int power) {
    const double factor = std::pow(kFactor, power);
    Trainer trainer(parts.learned, with_smoothness(options, factor));
    for (std::int64_t n = 0; n < n_steps; ++n) {
      monitor.check();
      trainer.step(static_cast<double>(n) / static_cast<double>(n_steps));
      monitor.report("smoothness", static_cast<std::uint64_t>(n + 1), static_cast<std::uint64_t>(n_steps));
    }
    trainer.finish();
    return SmoothnessTrial{factor, loss_of(trainer.field(), parts, options)};
  };
  SmoothnessChoice choice;
  std::vector<SmoothnessTrial>& trials = choice.trials;
  for (int power = -1; power <= 1; ++power) trials.push_back(trial(power));
  const auto best = [&] {
    return std::min_element(trials.begin(), trials.end(), [](const auto& a, const auto& b) { return a.loss < b.loss; });
  };
  for (int power = 2; power <= kFarthest && best() == std::prev(trials.end()); ++power) trials.push_back(trial(power));
  for (int power = 2; power <= kFarthest && best() == trials.begin(); ++power) trials.insert(trials.begin(), trial(-power));
  choice.factor = best()->factor;
  return choice;
}

}  // namespace sarnerf
