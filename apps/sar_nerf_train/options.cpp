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
    "The loss is the mean square error of power, and for --field surface of its root. Over a level ground, each error of power\n"
    "is divided by its standard deviation first.";

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

Kind<double> height_above_ground() {
  return number("M").checked([](const std::string& option, const std::string& text) {
    if (!(parse_number(option, text) > 0.0)) throw UsageError(option + ": " + text + " is not above 0 metres");
  });
}

void refuse_two_ends(const CommandLine& command) {
  if (!command.given("--time")) return;
  if (command.given("--steps")) throw UsageError("--steps and --time both say when training ends; give one of them");
}

void resolve_run(const CommandLine& command, Options& o) {
  o.resume = command.given("--resume");
  if (o.resume && command.given("--output"))
    throw UsageError("--resume writes into the run that it continues; leave out -o");
  if (o.resume && o.overwrite)
    throw UsageError("--resume continues a run and --overwrite discards it; give one of them");
  if (o.run.empty()) o.run = full_path(o.dataset).filename().string() + "_run";
}

void add_options(CommandLine& command, Options& o) {
  command.then([&] { o.shared = command.shared_options(); });
  command.add("DATASET", o.dataset, made_by("FOLDER", dataset_folder),
              "Folder with dataset.json, as sar_render makes it, or that file");
  command.require("DATASET");

  command.begin_group("Training");
  command.add("--field", o.field, one_of<std::string>({{"auto", "auto"}, {"surface", "surface"}, {"grid", "grid"}, {"mlp", "mlp"}, {"paper", "paper"}}),
              "An opaque surface, translucent voxels, the paper's network with ground, response, shifts and exact integration, or the paper's method to the letter; "
              "auto: surface or grid, as a short trial on three held-out views decides");
  command.refuse_replaced("--surfaces", "use --field surface");
  command.add("--register", o.registers,
              one_of<std::optional<bool>>({{"auto", std::nullopt}, {"on", true}, {"off", false}}),
              "Learn a shift and a gain of each view; auto: where dataset.json does not say that poses are exact");
  command.add("--ground-height", o.heights.ground_m, number("M").or_word("auto"),
              "Where the ground lies, in world coordinates; auto: where speckled views agree on its texture, else the bottom "
              "of the dataset's scene box");
  command.add("--scene-height", o.heights.above_ground_m, height_above_ground().or_word("auto"),
              "Greatest height of objects above a level ground; auto: under speckle what casts its shadow within the images, a quarter of the swath at most");
  command.add("--resolution", o.resolution, resolution_choice(),
              "-3 dB widths (m) of the images' impulse response, which becomes part of the model; auto: what dataset.json "
              "says");
  command.add("--window", o.resolution, window_of(o.resolution),
              "Its window, as for sar_render: none, hann, hamming, taylor:-35, kaiser:6");
  command.refuse_replaced("--smoothness", "its rule was dropped, leave it out");
  command.then([&] { refuse_two_ends(command); });
  command.add("--steps", o.steps, whole("N", 1, 1'000'000'000).or_word("auto", 0),
              "Steps of the optimiser; auto: 1000, and 600 where images show a ground; surface: 1000, with 100 images or more 1250");
  command.add("--time", o.time_s, seconds(),
              "Instead of --steps: 90, 90s, 2m or 1h from the program's start, loading included");
  command.read_later({"--steps"});
  command.add("--seed", o.seed, whole("N", 0, std::numeric_limits<std::int64_t>::max()), "Seed of the random numbers");
  command.add_list("--option", o.training, text("NAME=VALUE"),
                   "A training option, for experts; may be repeated (docs/guide/training.md)", {.separator = ','});

  command.begin_group("Validation");
  command.add("--holdout", o.holdout, made_by("N|PART|auto", parse_holdout, "auto"),
              "Views kept away from training, evenly spread: a number, a part (0.1, 10%), or auto: every "
              "12th of 48 or more");
  command.add("--against", o.against, made_by("FOLDER", dataset_folder),
              "Dataset whose views are predicted; those trained on are left out");
  command.add("--patience", o.patience, part("PART", 0.1, 1.0).or_word("off", 0.0),
              "End early and keep the best model when the held-out PSNR has not risen during this part of the training "
              "(0.2, 20%)");
  command.add("--lpips", o.lpips, path("FILE"), "Weights of LPIPS (.safetensors, docs/guide/lpips.md)");
  command.add("--despeckle", o.despeckle_deg, despeckle_degrees(),
              "Compare with averages of unseen views within so many degrees of azimuth, too (docs/guide/metrics.md)");
  command.read_later({"--seed"});

  command.begin_group("Output", /*in_files=*/false);
  command.add("-o,--output", o.run, made_by("RUN", without_slash), "Run folder; default DATASET_run");
  command.add("--resume", o.run, made_by("RUN", without_slash),
              "Continue this run; only --steps or --time may change, upwards");
  command.add_flag("--overwrite", o.overwrite, "Replace a run of other options, or repeat the same");
  command.add_flag("--explain", o.explain, "Print the plan before the work, with what is left out and why");
  command.add_flag("--dry-run", o.dry_run, "Print the plan and stop: nothing is written");
  command.then([&] { resolve_run(command, o); });

  command.same_meaning({"steps", "time"});
  command.add_shared_options();
}

/// The argument of an option, found before the command line is read; empty if the option is not given.
std::string text_behind(const std::string& option, int argc, char** argv) {
  for (int n = 1; n < argc; ++n) {
    const std::string_view argument = argv[n];
    if (argument == "--") break;
    if (argument == option && n + 1 < argc) return argv[n + 1];
    if (argument.starts_with(option + "=")) return std::string(argument.substr(option.size() + 1));
  }
  return {};
}

/// Throws UsageError if the run has another field. Called before the options are read, because options of one field
/// are invalid for the other.
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
  CommandLine command("sar_nerf_train", kDescription, kExamples);
  Options options;
  add_options(command, options);
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
  return options;
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kAny = std::numeric_limits<double>::max();

/// Limits of a training option. An option that is not listed may have any value from 0.
struct Limits {
  const char* name;
  double least, most;
};
constexpr Limits kLimits[] = {
    {"rows_per_step", 1, 1e6},
    {"voxel_size_m", 1e-6, 1e6},
    {"n_levels", 1, 10},
    {"harmonics_degree", 0, 2},
    {"skip", -1, 1000},
    {"position_frequencies", 0, 64},
    {"direction_frequencies", -1, 64},
    {"initial_depth", 1e-9, kAny},
    {"n_prunings", 0, 1000},
    {"n_registrations", 0, 1000},
    {"final_rate", 1e-9, 1},
    {"renderings", 1, 2},
    {"albedo_bins", 1e-2, 1e6},
    {"initial_softness_bins", 1e-6, 1e3},
    {"final_softness_bins", 1e-6, 1e3},
    {"shape_until", 1e-3, 1},
    {"anneal_until", 1e-3, 1},
    {"smoothing_bins2", 1e-9, kAny},
    {"final_smoothing_bins2", 1e-9, kAny},
    {"albedo_smoothing_bins2", 1e-9, kAny},
    {"final_albedo_smoothing_bins2", 1e-9, kAny},
    {"redistance_steps", 1, 1e9},
    {"refresh_steps", 1, 1e9},
    {"ray_spacing", 1e-2, 1e2},
    {"end_depth", 1e-3, kAny},
    {"most_ray_spacing_bins", 1e-2, 1e2},
    {"longest_segment", 1e-2, 1e2},
};

/// Most voxels of the scene box at the coarsest level, all of which carving visits.
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
  const double coarse_m = training.field == "grid" ? training.grid.voxel_size_m * std::pow(2.0, training.grid.n_levels - 1)
                          : training.field == "surface" ? training.surface.voxel_size_m * std::pow(2.0, training.surface.n_levels - 1)
                                                        : training.mlp.voxel_size_m;
  const glm::dvec3 size_m = set.box_m.size();
  const double n = std::ceil(size_m.x / coarse_m) * std::ceil(size_m.y / coarse_m) *
                   std::ceil(size_m.z / coarse_m);
  if (n <= kMostVoxels) return;
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

void require_common_options(const Options& o) {
  for (const std::string& text : o.training) {
    const std::string name = text.substr(0, text.find('='));
    std::string only;
    std::size_t n_fields = 0;
    for (const char* field : {"surface", "grid"}) {
      TrainerOptions options;
      options.field = field;
      if (!Json::parse(options_json(options)).contains(name)) continue;
      only = field;
      ++n_fields;
    }
    if (n_fields == 1)
      throw UsageError("--option " + name + ": is of the field " + only + " alone, and --field auto may choose another; give --field " +
                       only + ", too");
  }
}

TrainerOptions training_options(const Options& o, const TrainingSet& set) {
  TrainerOptions defaults = default_options(set, o.field, o.time_s ? Schedule::clock : Schedule::steps);
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
      refuse_replaced_option(name);
      const std::string closest = closest_name(name, names);
      throw UsageError("--option: there is no training option " + in_quotes(name) +
                       (closest.empty() ? "" : " (" + closest + "?)") +
                       "; docs/guide/training.md lists them");
    }
    json[name] = value_of(name, text.substr(equals + 1), json[name]);
  }
  const TrainerOptions training = options_from_json(json.dump());
  require_possible_voxels(training, set);
  return training;
}

}  // namespace sarnerf::app
