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
  visit("n_prunings", o.n_prunings);
}

/// Those of both networks: what the paper leaves open.
template <class Options, class Visit>
void for_each_network_option(Options& o, Visit&& visit) {
  visit("depth", o.shape.depth);
  visit("width", o.shape.width);
  visit("skip", o.shape.skip);
  visit("position_frequencies", o.shape.position_frequencies);
  visit("direction_frequencies", o.shape.direction_frequencies);
  visit("voxel_size_m", o.voxel_size_m);
  visit("rate", o.rate);
  visit("warm_up_steps", o.warm_up_steps);
  visit("initial_depth", o.initial_depth);
}

/// Those of `mlp` alone.
template <class Options, class Visit>
void for_each_mlp_option(Options& o, Visit&& visit) {
  visit("prune_depth", o.prune_depth);
  visit("refresh_steps", o.refresh_steps);
  visit("integrator", o.integrator);
}

/// Sets what the field `paper` does not leave open.
void fix_method(TrainerOptions& o) {
  if (o.field != "paper") return;
  o.n_registrations = 0;
  o.misfit = 0.0;
  o.mlp.literal = true;
  o.mlp.integrator = name(Integrator::paper_gated);
}

template <class Options, class Visit>
void for_each_surface_option(Options& o, Visit&& visit) {
  visit("voxel_size_m", o.voxel_size_m);
  visit("start", o.start);
  visit("bounce", o.bounce);
  visit("n_levels", o.n_levels);
  visit("shape_until", o.shape_until);
  visit("refined_by", o.refined_by);
  visit("albedo_bins", o.albedo_bins);
  visit("initial_softness_bins", o.initial_softness_bins);
  visit("final_softness_bins", o.final_softness_bins);
  visit("anneal_until", o.anneal_until);
  visit("step_bins", o.step_bins);
  visit("smoothing_bins2", o.smoothing_bins2);
  visit("final_smoothing_bins2", o.final_smoothing_bins2);
  visit("albedo_smoothing_bins2", o.albedo_smoothing_bins2);
  visit("final_albedo_smoothing_bins2", o.final_albedo_smoothing_bins2);
  visit("least_moment", o.least_moment);
  visit("beyond_hull_bins", o.beyond_hull_bins);
  visit("redistance_steps", o.redistance_steps);
  visit("refresh_steps", o.refresh_steps);
  visit("reached_steps", o.reached_steps);
  visit("albedo_rate", o.albedo_rate);
  visit("exponent_rate", o.exponent_rate);
  visit("directional_rate", o.directional_rate);
}

/// Calls visit(name, member) for every option that concerns the field. What the paper fixes (fix_method()) is none of the field `paper`.
template <class Options, class Visit>
void for_each_option(Options& o, Visit&& visit) {
  const bool is_paper = o.field == "paper";
  visit("field", o.field);
  if (is_network(o.field)) for_each_network_option(o.mlp, visit);
  if (o.field == "surface") {
    for_each_surface_option(o.surface, visit);
  } else if (!is_network(o.field)) {
    for_each_grid_option(o.grid, visit);
  } else if (!is_paper) {
    for_each_mlp_option(o.mlp, visit);
  }
  visit("rows_per_step", o.rows_per_step);
  if (!is_paper) {
    visit("renderings", o.renderings);
    visit("ray_spacing", o.ray_spacing);
    visit("most_ray_spacing_bins", o.most_ray_spacing_bins);
    visit("longest_segment", o.longest_segment);
    visit("end_depth", o.end_depth);
  }
  visit("final_rate", o.final_rate);
  if (!is_paper) {
    visit("misfit", o.misfit);
    visit("error_bound", o.error_bound);
    visit("n_registrations", o.n_registrations);
  }
  visit("seed", o.seed);
}

/// Options of older versions, and what replaces them; empty: nothing, for the rule was dropped (docs/results/ablation.md).
const std::map<std::string, std::string> kReplaced = {
    {"speckle_floor", "misfit"}, {"relative_epsilon", "misfit"}, {"speckle_most", ""}, {"huber_delta", ""},
    {"distortion", ""}, {"final_distortion", ""}, {"prune_exposure", ""}, {"smooth_density", ""}, {"smooth_source", ""},
    {"smooth_angular", ""}, {"brightness_decay", ""}, {"final_brightness_decay", ""}};

/// With --time: a step with halved voxels takes about four times as long.
constexpr int kClockStepsLeft = 300;

/// With incidences this far apart (rad), images show how brightness and range depend on the incidence.
constexpr double kIncidencesDiffer = 5.0 * std::numbers::pi / 180.0;

/// Images from which on the field `surface` needs more steps: those that see a voxel come more rarely.
constexpr std::size_t kManyImages = 100;

/// With fewer images, harmonics of degree 2 are not determined.
constexpr std::size_t kLeastOfManyDirections = 36;

bool incidences_differ(const TrainingSet& set) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const PosedImage& image : set.images) {
    least = std::min(least, image.acquisition.incidence_rad);
    most = std::max(most, image.acquisition.incidence_rad);
  }
  return most - least > kIncidencesDiffer;
}

/// Whether many images from different incidences see the scene, without a background.
bool is_seen_from_many_directions(const TrainingSet& set) {
  return set.images.size() >= kLeastOfManyDirections && !set.background && incidences_differ(set);
}

}  // namespace

TrainerOptions default_options(const TrainingSet& set, const std::string& field, Schedule schedule) {
  TrainerOptions options;
  if (schedule == Schedule::clock) options.grid.refine_steps_left = kClockStepsLeft;
  options.field = field;
  const double bin_m = set.finest_bin_m();
  options.grid.voxel_size_m = 2.0 / 3.0 * bin_m;
  if (!set.exact_poses) options.n_registrations = 20;
  if (set.background && !set.ground) {
    // Nothing is carved. All voxels begin nearly transparent, and empty ones are removed from progress 0.2 on.
    options.grid.initial_depth = 0.01;
    options.grid.n_levels = 3;
    options.rows_per_step = 70;
    options.grid.prune_from = 0.2;
  }
  if (is_seen_from_many_directions(set)) options.grid.harmonics_degree = 2;
  options.mlp.voxel_size_m = bin_m;
  options.mlp.shape.position_frequencies = suitable_frequencies(set.box_m, bin_m);
  options.mlp.shape.direction_frequencies = suitable_direction_frequencies(set.images);
  options.surface.voxel_size_m = 0.5 * bin_m;
  // At one incidence a bounce can hardly be told from a scatterer nearer to the ground. Where poses are exact, sar_render made the
  // images: it renders single bounces.
  options.surface.bounce = set.ground && !set.exact_poses && incidences_differ(set);
  if (field == "surface") {
    options.renderings = 2;
    options.final_rate = 0.1;
    options.misfit = 0.3;
    options.error_bound = 1.0;
  }
  if (field == "paper") options.mlp.shape = {};
  if (is_network(field)) {
    options.rows_per_step = 10;
    options.ray_spacing = 1.0;
    options.end_depth = 7.0;
    options.final_rate = 0.1;
  }
  fix_method(options);
  return options;
}

std::int64_t default_steps(const TrainingSet& set, const std::string& field) {
  if (field == "surface") return set.images.size() < kManyImages ? 1000 : 1250;
  return set.ground ? 600 : 1000;
}

std::string options_json(const TrainerOptions& options) {
  Json json = Json::object();
  for_each_option(options, [&](const char* name, const auto& value) { json[name] = value; });
  return json.dump();
}

void refuse_replaced_option(const std::string& name) {
  const auto replaced = kReplaced.find(name);
  if (replaced != kReplaced.end())
    throw UsageError("training option '" + name + "' is of an older version: " +
                     (replaced->second.empty() ? "its rule was dropped, leave it out" : "use " + replaced->second));
}

TrainerOptions options_from_json(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) throw UsageError("training options must be a JSON object, found: " + text.substr(0, 80));
  TrainerOptions options;
  // Which options there are depends on the field.
  if (json.contains("field") && json.at("field").is_string()) options.field = json.at("field").get<std::string>();
  fix_method(options);
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

}  // namespace sarnerf
