// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>

#include <nlohmann/json.hpp>

#include "command_line.h"
#include "nerf_common.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/nerf/trainer.h"
#include "values.h"

namespace sarnerf::app {

namespace {

constexpr const char* kDescription =
    "Learns a scene from the SAR images of a dataset folder (SAR-NeRF), on the processor.\n"
    "Writes a run folder: model.pt for sar_nerf_render, checkpoints/, metrics.jsonl, report.html. "
    "The same\n"
    "command continues after an interruption. Images of amplitude are squared: what is modelled is "
    "power.\n"
    "The loss is the mean square error of power; over a level ground, of relative errors with a bound.";

constexpr const char* kExamples =
    "Examples:\n"
    "  sar_nerf_train cuboid/ -o cuboid_run --time 30s\n"
    "  sar_nerf_train cuboid/ -o cuboid_run --against cuboid_test/\n"
    "  sar_nerf_train --resume cuboid_run --steps 2000\n"
    "Raising --steps: rates and resolution stay where they are until the longer schedule has come "
    "as far, and\n"
    "follow it then; a finished run goes on at the lowest rates.\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 training diverged, "
    "130 interrupted.";

/// The texts of all options, as given.
struct Texts {
  std::string dataset, field = "grid", surfaces = "auto", ground_height = "auto", scene_height = "auto", steps = "auto", time;
  std::string resolution = "auto", window, smoothness = "auto";
  std::string holdout = "auto", patience = "off", against, lpips, despeckle = "off", seed = "1";
  std::vector<std::string> training;
  std::string output, resume;
  bool overwrite = false, explain = false, dry_run = false;
};

void add_options(CommandLine& command, Texts& t) {
  CLI::App& p = command.parser();
  const auto add = [&](const char* name, std::string& text, const char* type, const char* help) {
    return command.add_text_option(name, text, type, help);
  };
  p.add_option("DATASET", t.dataset, "Folder with dataset.json, as sar_render makes it, or that file")
      ->type_name("FOLDER")
      ->required();

  command.begin_group("Training");
  add("--field", t.field, "grid|mlp", "Sparse voxels, or the paper's network")
      ->check(one_of({"grid", "mlp"}));
  add("--surfaces", t.surfaces, "auto|on|off",
      "Learn opaque matter, from which surfaces can be taken; auto: with 36 or more images of different incidences "
      "and no background")
      ->check(one_of({"auto", "on", "off"}));
  add("--ground-height", t.ground_height, "M|auto",
      "Where the ground lies, in world coordinates; auto: where speckled views agree on its texture, else the bottom of the "
      "dataset's scene box");
  add("--scene-height", t.scene_height, "M|auto",
      "Greatest height of matter above a level ground; auto: under speckle a quarter of the ground's width that a view shows");
  add("--resolution", t.resolution, "A[,R]|auto|none",
      "-3 dB widths (m) of the images' impulse response, which becomes part of the model; auto: what dataset.json says");
  add("--window", t.window, "NAME", "Its window, as for sar_render: none, hann, hamming, taylor:-35, kaiser:6");
  add("--smoothness", t.smoothness, "FACTOR|auto|validated",
      "Factor over the default weights of the smoothness priors; validated: chosen by held-out views, in trainings of their own");
  add("--steps", t.steps, "N|auto", "Steps of the optimiser; auto: 1000, and 600 where images show a ground");
  add("--time", t.time, "TIME",
      "Instead of --steps: 90, 90s, 2m or 1h from the program's start, loading included");
  add("--seed", t.seed, "N", "Of all that is random");
  p.add_option("--option", t.training,
               "A training option, for experts; may be repeated (docs/training.md)")
      ->type_name("NAME=VALUE")
      ->delimiter(',')
      ->group("Training");

  command.begin_group("Validation");
  add("--holdout", t.holdout, "N|PART|auto",
      "Views kept away from training, evenly spread: a number, a part (0.1, 10%), or auto: every "
      "12th of 48 or more");
  add("--against", t.against, "FOLDER",
      "Dataset whose views are predicted; those trained on are left out");
  add("--patience", t.patience, "PART|off",
      "End early and keep the best model when held-out views have come no closer for this part of "
      "the training (0.2, 20%)");
  add("--lpips", t.lpips, "FILE", "Weights of LPIPS (.safetensors, docs/lpips.md)");
  add("--despeckle", t.despeckle, "DEG|off",
      "Compare with averages of unseen views within so many degrees of azimuth, too (docs/metrics.md)");

  command.begin_group("Output");
  add("-o,--output", t.output, "RUN", "Run folder; default DATASET_run")->configurable(false);
  add("--resume", t.resume, "RUN", "Continue this run; nothing but --steps or --time may be raised")
      ->configurable(false);
  command.add_flag("--overwrite", t.overwrite, "Replace a run of other options, or repeat the same")
      ->configurable(false);
  command.add_flag("--explain", t.explain,
             "Print the plan before the work, with what is left out and why")
      ->configurable(false);
  command.add_flag("--dry-run", t.dry_run, "Print the plan and stop: nothing is written")->configurable(false);

  command.same_meaning({"steps", "time"});
  command.add_shared_options();
  p.footer(kExamples);
}

Smoothness parse_smoothness(const Texts& t) {
  Smoothness smoothness;
  if (t.smoothness == "auto") return smoothness;
  if (t.field != "grid") throw UsageError("--smoothness is that of the field grid; leave it out");
  smoothness.validated = t.smoothness == "validated";
  if (!smoothness.validated) smoothness.factor = parse_between("--smoothness", t.smoothness, 0.0, 1e6);
  if (smoothness.validated && !t.time.empty())
    throw UsageError("--smoothness validated trains several times, each by steps; give --steps instead of --time");
  return smoothness;
}

Options resolve(const Texts& t, const CommandLine& command, bool steps_given) {
  Options o;
  o.shared = command.shared_options();
  o.dataset = dataset_folder(t.dataset);
  o.field = t.field;
  if (t.surfaces != "auto") o.surfaces = t.surfaces == "on";
  if (t.ground_height != "auto") o.heights.ground_m = parse_number("--ground-height", t.ground_height);
  if (t.scene_height != "auto") {
    o.heights.above_ground_m = parse_number("--scene-height", t.scene_height);
    if (!(*o.heights.above_ground_m > 0.0)) throw UsageError("--scene-height: " + t.scene_height + " is not above 0 metres");
  }
  o.resolution = parse_resolution(t.resolution, t.window);
  o.smoothness = parse_smoothness(t);
  if (!t.time.empty()) {
    if (steps_given)
      throw UsageError("--steps and --time both say when training ends; give one of them");
    o.time_s = parse_seconds("--time", t.time);
  }
  if (t.steps != "auto") o.steps = parse_whole("--steps", t.steps, 1, 1'000'000'000);
  o.holdout_text = t.holdout;
  o.holdout = parse_holdout(t.holdout);
  if (t.patience != "off") o.patience = parse_part("--patience", t.patience, 0.1, 1.0);
  o.against = dataset_folder(t.against);
  o.lpips = t.lpips;
  o.despeckle_deg = parse_despeckle_deg(t.despeckle);
  o.seed = static_cast<std::uint64_t>(
      parse_whole("--seed", t.seed, 0, std::numeric_limits<std::int64_t>::max()));
  o.training = t.training;
  o.resume = !t.resume.empty();
  if (o.resume && !t.output.empty())
    throw UsageError("--resume writes into the run that it continues; leave out -o");
  if (o.resume && t.overwrite)
    throw UsageError("--resume continues a run and --overwrite discards it; give one of them");
  o.run = without_slash(o.resume ? t.resume : t.output);
  if (o.run.empty()) o.run = full_path(o.dataset).filename().string() + "_run";
  o.overwrite = t.overwrite;
  o.explain = t.explain;
  o.dry_run = t.dry_run;
  return o;
}

/// What stands behind an option, before the command line is read; empty where it is not given.
std::string text_behind(const std::string& option, int argc, char** argv) {
  for (int n = 1; n < argc; ++n) {
    const std::string_view argument = argv[n];
    if (argument == "--") break;
    if (argument == option && n + 1 < argc) return argv[n + 1];
    if (argument.starts_with(option + "=")) return std::string(argument.substr(option.size() + 1));
  }
  return {};
}

/// The options of one field mean nothing to the other, so that this comes before they are read.
void require_field_of_run(const std::filesystem::path& config, const std::string& asked_for) {
  std::ifstream file(config);
  for (const FlatItem& item : read_flat_toml(file, config.string())) {
    if (item.name != "field" || item.values.size() != 1 || item.values[0] == asked_for) continue;
    throw UsageError("--field " + asked_for + ": the run that --resume names learns the field " + item.values[0] +
                     ", and goes on with it; leave out --field, or begin another run");
  }
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_nerf_train", kDescription);
  Texts texts;
  add_options(command, texts);
  std::vector<std::string> arguments(argv, argv + argc);
  if (const std::string run = text_behind("--resume", argc, argv); !run.empty()) {
    for (const std::string& argument : arguments) {
      if (argument == "--config" || argument.starts_with("--config="))
        throw UsageError(
            "--resume takes the options of the run that it continues; leave out --config");
    }
    const RunFolder folder(run);
    std::error_code ignored;
    if (!std::filesystem::exists(folder.config(), ignored))
      throw InputError(
          run +
          ": expected the folder of a run with its config.toml, found none; is the name right?");
    if (const std::string field = text_behind("--field", argc, argv); !field.empty())
      require_field_of_run(folder.config(), field);
    arguments.insert(arguments.begin() + 1, {"--config", folder.config().string()});
  }
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  if (!command.parse(static_cast<int>(pointers.size()), pointers.data())) return std::nullopt;
  return resolve(texts, command, command.parser().get_option("--steps")->count() > 0);
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kAny = std::numeric_limits<double>::max();

/// What is not listed may be anything from 0.
struct Limits {
  const char* name;
  double least, most;
};
constexpr Limits kLimits[] = {
    {"rows_per_step", 1, 1e6},
    {"voxel_size_m", 1e-6, 1e6},
    {"n_levels", 1, 10},
    {"harmonics_degree", 0, 2},
    {"n_prunings", 0, 1000},
    {"final_rate", 1e-9, 1},
    {"ray_spacing", 1e-2, 1e2},
    {"end_depth", 1e-3, kAny},
    {"most_ray_spacing_bins", 1e-2, 1e2},
    {"longest_segment", 1e-2, 1e2},
};

/// Voxels of the scene box at the coarsest level: what carving looks at.
constexpr double kMostVoxels = 4e8;

void require_within_limits(const std::string& name, double value) {
  Limits limits{"", 0.0, kAny};
  for (const Limits& l : kLimits) {
    if (name == l.name) limits = l;
  }
  if (value >= limits.least && value <= limits.most) return;
  char text[160];
  if (limits.most == kAny) {
    std::snprintf(text, sizeof text, ": expected at least %.6g, found %.6g", limits.least, value);
  } else {
    std::snprintf(text, sizeof text, ": expected %.6g to %.6g, found %.6g", limits.least,
                  limits.most, value);
  }
  throw UsageError("--option " + name + text);
}

void require_possible_voxels(const TrainerOptions& training, const TrainingSet& set) {
  const double coarse_m = training.grid.voxel_size_m * std::pow(2.0, training.grid.n_levels - 1);
  const glm::dvec3 size_m = set.box_m.size();
  const double n = std::ceil(size_m.x / coarse_m) * std::ceil(size_m.y / coarse_m) *
                   std::ceil(size_m.z / coarse_m);
  if (training.field != "grid" || n <= kMostVoxels) return;
  char text[200];
  std::snprintf(text, sizeof text,
                "the scene's box of %.4g x %.4g x %.4g m has %.3g voxels of %.3g m to begin with, "
                "more than %.0e; use larger "
                "ones (--option voxel_size_m=...)",
                size_m.x, size_m.y, size_m.z, n, coarse_m, kMostVoxels);
  throw UsageError(text);
}

Json value_of(const std::string& name, const std::string& text, const Json& like) {
  const Json value = Json::parse(text, nullptr, false);
  const bool fits = like.is_string()    ? true
                    : like.is_boolean() ? value.is_boolean()
                    : like.is_number_integer()
                        ? value.is_number_integer()
                        : value.is_number() && std::isfinite(value.get<double>());
  if (!fits)
    throw UsageError("--option " + name + ": expected " +
                     (like.is_boolean()          ? "true or false"
                      : like.is_number_integer() ? "a whole number"
                                                 : "a number") +
                     " such as " + like.dump() + ", found " + in_quotes(text));
  if (!like.is_string() && !like.is_boolean()) require_within_limits(name, value.get<double>());
  return like.is_string() ? Json(text) : value;
}

}  // namespace

TrainerOptions training_options(const Options& o, const TrainingSet& set) {
  TrainerOptions defaults = default_options(set, o.field, o.time_s ? Schedule::clock : Schedule::steps, o.surfaces);
  defaults.seed = o.seed;
  Json json = Json::parse(options_json(defaults));
  std::vector<std::string> names;
  for (const auto& [name, value] : json.items()) names.push_back(name);
  for (const std::string& text : o.training) {
    const auto equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos)
      throw UsageError("--option: expected NAME=VALUE such as rows_per_step=140, found " +
                       in_quotes(text));
    if (name == "field" || name == "seed")
      throw UsageError("--option " + name + ": has an option of its own, --" + name);
    if (!json.contains(name)) {
      const std::string closest = closest_name(name, names);
      throw UsageError("--option: there is no training option " + in_quotes(name) +
                       (closest.empty() ? "" : " (" + closest + "?)") +
                       "; docs/training.md lists them");
    }
    json[name] = value_of(name, text.substr(equals + 1), json[name]);
  }
  const TrainerOptions training = options_from_json(json.dump());
  require_possible_voxels(training, set);
  return training;
}

namespace {

/// Half as many steps tell which smoothness is the best.
constexpr std::int64_t kShorter = 2;

std::string text_of(const SmoothnessChoice& choice) {
  std::string text;
  for (const SmoothnessTrial& trial : choice.trials)
    text += format("%s%.6g at %.3g", text.empty() ? "" : ", ", trial.loss, trial.factor);
  return format("smoothness: %.3g times what suits as many views (loss of held-out views: %s)", choice.factor, text.c_str());
}

}  // namespace

TrainerOptions with_chosen_smoothness(const Options& o, const TrainerOptions& training, const TrainingSet& set,
                                      const RunFolder& folder, Console& console, const Monitor& monitor) {
  if (!o.smoothness.validated) return with_smoothness(training, o.smoothness.factor);
  std::error_code ignored;
  if (!o.overwrite && std::filesystem::exists(folder.config(), ignored))
    if (const auto found = smoothness_in(folder.config())) {
      TrainerOptions same = training;
      std::tie(same.grid.smooth_density, same.grid.smooth_source, same.grid.smooth_angular) = *found;
      return same;
    }
  const SmoothnessChoice choice = choose_smoothness(set, training, std::max<std::int64_t>(1, o.steps / kShorter), monitor);
  console.note(text_of(choice));
  return with_smoothness(training, choice.factor);
}

}  // namespace sarnerf::app
