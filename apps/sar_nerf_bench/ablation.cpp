// SPDX-License-Identifier: Apache-2.0
// The ablation: each rule and prior of learning left out alone, and what that costs on views that were not learned from.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "app_main.h"
#include "command_line.h"
#include "nerf_common.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/nerf/trainer.h"
#include "study.h"
#include "torch_setup.h"
#include "values.h"

namespace sarnerf::bench {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A data set and the clean views that it is judged by.
struct AblationData {
  std::string name;
  std::string method;  ///< fingerprint of the images and of what all trainings on them have in common
  Dataset dataset;
  std::vector<PosedImage> images, truth;
  bool is_speckled = false;  ///< the ground that the images show: its score is log amplitude's
};

/// All that a rule can change.
struct Method {
  GroundRule ground;
  bool knows_response = true;
  bool registers = true;
  std::vector<std::function<void(TrainerOptions&, const TrainingSet&)>> options;  ///< applied to the default ones in this order
};

struct Rule {
  std::string name, text;  ///< no text where the name says it all
  std::function<bool(const TrainerOptions&, const TrainingSet&)> acts;
  std::function<void(Method&)> leave_out;
};

using Set = const TrainingSet&;
using O = TrainerOptions;

bool over_ground(const O&, Set s) { return s.ground.has_value(); }
bool speckled(const O&, Set s) { return s.ground && s.ground->speckled; }
bool always(const O&, Set) { return true; }
bool as_measured(const O&, Set s) { return s.ground && !s.exact_poses; }

/// A rule that sets an option, left out by setting it to what it would be without.
Rule option_rule(const char* name, const char* text, std::function<bool(const O&, Set)> acts,
                 std::function<void(O&, Set)> without) {
  return {name, text, std::move(acts), [without = std::move(without)](Method& m) { m.options.push_back(without); }};
}

Rule ground_rule(const char* name, const char* text, std::function<bool(const O&, Set)> acts,
                 std::function<void(GroundRule&)> without) {
  return {name, text, std::move(acts), [without = std::move(without)](Method& m) { without(m.ground); }};
}

const std::vector<Rule>& rules() {
  const GridOptions grid;
  const O plain;
  static const std::vector<Rule> all{
      option_rule("relative_loss", "errors over their standard deviation (else squares)", over_ground,
                  [](O& o, Set) { o.misfit = 0.0; }),
      ground_rule("texture", "texture of the ground", as_measured, [](GroundRule& g) { g.texture_sigmas_cells.clear(); }),
      ground_rule("height", "estimated height of the ground", as_measured,
                  [](GroundRule& g) { g.height_significance = std::numeric_limits<double>::infinity(); }),
      ground_rule("carving", "bare ground carves", over_ground, [](GroundRule& g) { g.bare_fraction = 2.0; }),
      ground_rule("object_height", "height of a quarter of the swath", speckled,
                  [](GroundRule& g) { g.object_height_fraction = 1e9; }),
      ground_rule("noise", "noise in shadows", speckled, [](GroundRule& g) { g.noise = false; }),
      {"registration", "shifts and gains of views", [](const O& o, Set) { return o.n_registrations > 0; },
       [](Method& m) { m.registers = false; }},
      {"response", "the known response", [](const O&, Set s) { return s.resolution.has_value(); },
       [](Method& m) { m.knows_response = false; }},
      option_rule("no_ground_found", "thin fog, three levels, late pruning over what is no ground",
                  [](const O&, Set s) { return s.background && !s.ground; },
                  [=](O& o, Set) {
                    o.grid.initial_depth = grid.initial_depth;
                    o.grid.n_levels = grid.n_levels;
                    o.grid.prune_from = grid.prune_from;
                    o.rows_per_step = plain.rows_per_step;
                  }),
      ground_rule("tails_are_dark", "tails of an unknown response are dark", [](const O&, Set s) { return s.tails_are_dark; },
                  [](GroundRule& g) { g.tail_level = 0.0; }),
      option_rule("harmonics", "harmonics of degree 2 where many directions are seen (else 1)",
                  [](const O& o, Set) { return o.grid.harmonics_degree > 1; }, [](O& o, Set) { o.grid.harmonics_degree = 1; }),
      option_rule("pruning", "empty voxels are given up", always, [](O& o, Set) { o.grid.n_prunings = 0; }),
      option_rule("levels", "coarse voxels first", always, [](O& o, Set) { o.grid.n_levels = 1; }),
      option_rule("falling_rates", "falling rates (else to a half)", always, [](O& o, Set) { o.final_rate = 0.5; }),
  };
  return all;
}

/// A number of the method; its name ends with what it was multiplied by.
struct Constant {
  const char* name;
  bool (*acts)(const O&, Set);
  std::function<void(Method&, double factor)> multiply;
};

Constant option_constant(const char* name, bool (*acts)(const O&, Set), double& (*member)(O&)) {
  return {name, acts, [member](Method& m, double factor) {
            m.options.emplace_back([member, factor](O& o, Set) { member(o) *= factor; });
          }};
}

/// Rounded, one at least.
Constant option_number(const char* name, bool (*acts)(const O&, Set), int& (*member)(O&)) {
  return {name, acts, [member](Method& m, double factor) {
            m.options.emplace_back([member, factor](O& o, Set) {
              member(o) = std::max(1, static_cast<int>(std::lround(factor * member(o))));
            });
          }};
}

Constant ground_constant(const char* name, bool (*acts)(const O&, Set), double& (*member)(GroundRule&)) {
  return {name, acts, [member](Method& m, double factor) { member(m.ground) *= factor; }};
}

std::vector<Constant> constants() {
  using G = GroundRule;
  return {
      option_constant("misfit", over_ground, [](O& o) -> double& { return o.misfit; }),
      option_constant("final_rate", always, [](O& o) -> double& { return o.final_rate; }),
      option_constant("density_rate", always, [](O& o) -> double& { return o.grid.density_rate; }),
      option_constant("source_rate", always, [](O& o) -> double& { return o.grid.source_rate; }),
      option_constant("initial_depth", always, [](O& o) -> double& { return o.grid.initial_depth; }),
      option_constant("initial_brightness", always, [](O& o) -> double& { return o.grid.initial_brightness; }),
      option_constant("prune_depth", always, [](O& o) -> double& { return o.grid.prune_depth; }),
      option_number("n_prunings", always, [](O& o) -> int& { return o.grid.n_prunings; }),
      option_constant("voxel_size_m", always, [](O& o) -> double& { return o.grid.voxel_size_m; }),
      option_number("rows_per_step", always, [](O& o) -> int& { return o.rows_per_step; }),
      option_constant("ray_spacing", always, [](O& o) -> double& { return o.ray_spacing; }),
      option_constant("longest_segment", always, [](O& o) -> double& { return o.longest_segment; }),
      option_constant("end_depth", always, [](O& o) -> double& { return o.end_depth; }),
      option_number("n_registrations", as_measured, [](O& o) -> int& { return o.n_registrations; }),
      ground_constant("bare_fraction", over_ground, [](G& g) -> double& { return g.bare_fraction; }),
      ground_constant("mask_sigma_pixels", over_ground, [](G& g) -> double& { return g.mask_sigma_pixels; }),
      ground_constant("mask_factor", over_ground, [](G& g) -> double& { return g.mask_factor; }),
      ground_constant("height_sigma_pixels", as_measured, [](G& g) -> double& { return g.height_sigma_pixels; }),
      ground_constant("height_significance", as_measured, [](G& g) -> double& { return g.height_significance; }),
      {"block_pixels", over_ground,
       [](Method& m, double factor) { m.ground.block_pixels = static_cast<int>(std::lround(factor * m.ground.block_pixels)); }},
  };
}

/// Each constant doubled and halved, as rules are left out.
const std::vector<Rule>& changed_constants() {
  static const std::vector<Rule> all = [] {
    std::vector<Rule> list;
    for (const Constant& c : constants())
      for (const double factor : {2.0, 0.5})
        list.push_back({format("%s x %g", c.name, factor), {}, c.acts,
                        [multiply = c.multiply, factor](Method& m) { multiply(m, factor); }});
    return list;
  }();
  return all;
}

/// One training: how good, and in how many seconds.
struct Cell {
  std::string set, method, rule;
  int seed = 1;
  double psnr_power_db = 0.0, psnr_log_amplitude_db = 0.0, seconds = 0.0;
  bool is_speckled = false;

  /// Power on clean data, log amplitude on speckle.
  double score_db() const { return is_speckled ? psnr_log_amplitude_db : psnr_power_db; }
};

const std::string kAll = "all";

struct AblationOptions {
  std::vector<std::string> folders, only, without;
  std::vector<const Rule*> base;  ///< left out of every training
  fs::path output;
  int n_seeds = 2;
  std::int64_t n_steps = 0;
  bool constants = false;
  bool dry_run = false;

  const std::vector<Rule>& candidates() const { return constants ? changed_constants() : rules(); }
  app::SharedOptions shared;
};

/// What measured chips have and sar_render's images do not: an unknown gain of each view, 1 dB (standard deviation) about a
/// mean of 0 dB, and a scene box that reaches 2 m below the ground. (Their shifts are in the images: scripts/ablation.sh.)
void make_as_measured(AblationData& m) {
  std::mt19937_64 random(1);
  std::vector<double> log_gain(m.images.size());
  double mean = 0.0;
  for (double& g : log_gain) {
    // Twelve uniform numbers sum to a normal one, nearly, and alike with every library.
    for (int n = 0; n < 12; ++n) g += static_cast<double>(random() >> 11) * 0x1p-53 - 0.5;
    mean += g / static_cast<double>(log_gain.size());
  }
  for (std::size_t v = 0; v < m.images.size(); ++v) {
    const auto gain = static_cast<float>(std::pow(10.0, 0.1 * (log_gain[v] - mean)));
    for (float& p : m.images[v].power.pixels()) p *= gain;
  }
  m.dataset.scene_box_m.min.y -= 2.0;
}

AblationData read(const std::string& folder, const AblationOptions& o) {
  AblationData m;
  m.name = fs::path(folder).filename().string();
  m.dataset = read_manifest(folder);
  const auto all = [](const Dataset& d) {
    std::vector<std::size_t> places(d.views.size());
    for (std::size_t n = 0; n < places.size(); ++n) places[n] = n;
    return places;
  };
  m.images = load_images(folder, m.dataset, all(m.dataset));
  if (!m.dataset.exact_poses) make_as_measured(m);
  const std::string truth = folder + ".truth";
  const Dataset other = read_manifest(truth);
  m.truth = load_images(truth, other, all(other));
  for (PosedImage& view : m.truth) view.acquisition.aim_m = glm::dvec3(0.0);
  std::string method = std::to_string(o.n_steps) + " " + dataset_fingerprint(folder, m.dataset) + " " + dataset_fingerprint(truth, other);
  for (const std::string& rule : o.without) method += " " + rule;
  m.method = sha256_hex(std::as_bytes(std::span(method))).substr(0, 16);
  return m;
}

/// Of a method, from all that is known of the images.
TrainingSet set_of(const AblationData& m, const Method& method) {
  const std::optional<Resolution> resolution = method.knows_response ? m.dataset.resolution : std::optional<Resolution>();
  if (m.dataset.exact_poses || !method.registers)
    return training_set(m.images, m.dataset.scene_box_m, {}, resolution, method.ground);
  return app::registered_training_set(m.images, m.dataset.scene_box_m, {}, resolution, method.ground).set;
}

TrainerOptions options_of(const TrainingSet& set) {
  return default_options(set, "grid", Schedule::steps);
}

/// What is ablated on a data set: the method without the rules of --without, each of them where it acts.
struct Ablated {
  Method method;
  std::vector<const Rule*> acting;  ///< the rules of --rules that act in it
};

/// Also finds out whether the set's ground is speckled.
Ablated ablated(AblationData& m, const AblationOptions& o) {
  Ablated base;
  TrainingSet set = set_of(m, base.method);
  m.is_speckled = set.ground && set.ground->speckled;
  TrainerOptions options = options_of(set);
  if (!o.base.empty()) {
    for (const Rule* rule : o.base)
      if (rule->acts(options, set)) rule->leave_out(base.method);
    set = set_of(m, base.method);
    options = options_of(set);
    for (const auto& change : base.method.options) change(options, set);
  }
  const auto chosen = [&](const std::string& name) { return o.only.empty() || std::ranges::find(o.only, name) != o.only.end(); };
  for (const Rule& rule : o.candidates())
    if (chosen(rule.name) && std::ranges::find(o.base, &rule) == o.base.end() && rule.acts(options, set))
      base.acting.push_back(&rule);
  return base;
}

Cell learn(const AblationData& m, Method method, const Rule* rule, int seed, std::int64_t n_steps, const Monitor& monitor) {
  if (rule) rule->leave_out(method);
  WorkClock clock(0.0, 0.0);
  TrainingSet set = set_of(m, method);
  TrainerOptions options = options_of(set);
  for (const auto& change : method.options) change(options, set);
  options.seed = static_cast<std::uint64_t>(seed);
  if (n_steps == 0) n_steps = default_steps(set, "grid");
  Cell cell{m.name, m.method, rule ? rule->name : kAll, seed};
  cell.is_speckled = m.is_speckled;
  Trainer trainer(std::move(set), options);
  for (std::int64_t n = 0; n < n_steps; ++n) {
    monitor.check();
    trainer.step(static_cast<double>(n) / static_cast<double>(n_steps));
  }
  cell.seconds = clock.seconds();
  const double peak = peak_power(m.truth);
  for (const PosedImage& truth : m.truth) {
    const Image<float> view = render_view(trainer.field(), truth.acquisition);
    const auto n = static_cast<double>(m.truth.size());
    cell.psnr_power_db += score_view(view, truth, peak).psnr_power_db / n;
    cell.psnr_log_amplitude_db += score_background(view, truth, peak).log_amplitude_psnr_db / n;
  }
  return cell;
}

Json json_of(const Cell& c) {
  return {{"set", c.set}, {"method", c.method}, {"without", c.rule}, {"seed", c.seed}, {"psnr_power_db", c.psnr_power_db},
          {"psnr_log_amplitude_db", c.psnr_log_amplitude_db}, {"speckled", c.is_speckled}, {"seconds", c.seconds}};
}

/// Whether an interruption cut off the last line.
bool ends_within_a_line(const fs::path& file) {
  std::ifstream in(file, std::ios::ate | std::ios::binary);
  if (in.tellg() <= 0) return false;
  in.seekg(-1, std::ios::end);
  return in.get() != '\n';
}

std::vector<Cell> cells_of(const fs::path& file) {
  std::vector<Cell> cells;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const Json j = Json::parse(line, nullptr, false);
    if (!j.is_object()) continue;  // a line that an interruption cut off
    cells.push_back({j.at("set"), j.value("method", ""), j.at("without"), j.at("seed"), j.at("psnr_power_db"), j.at("psnr_log_amplitude_db"),
                     j.at("seconds"), j.at("speckled")});
  }
  return cells;
}

/// Mean over seeds of the score with everything, less that without the rule, by scene.
std::vector<double> gains_of(const std::vector<Cell>& cells, const std::string& rule, bool of_power) {
  std::map<std::pair<std::string, int>, double> with;
  const auto score = [&](const Cell& c) { return of_power ? c.psnr_power_db : c.score_db(); };
  for (const Cell& c : cells)
    if (c.rule == kAll) with[{c.set, c.seed}] = score(c);
  std::map<std::string, std::vector<double>> of_set;
  for (const Cell& c : cells) {
    const auto all = with.find({c.set, c.seed});
    if (c.rule == rule && all != with.end()) of_set[c.set].push_back(all->second - score(c));
  }
  std::vector<double> gains;
  for (const auto& [set, of_seed] : of_set) {
    double sum = 0.0;
    for (const double g : of_seed) sum += g;
    gains.push_back(sum / static_cast<double>(of_seed.size()));
  }
  return gains;
}

const char* rule_verdict(const PairedDifference& gain, std::size_t n_scenes) {
  constexpr double kLeastGain_db = 0.3;
  constexpr std::size_t kLeastScenes = 5;
  if (n_scenes < kLeastScenes) return "too few scenes";
  return gain.low > 0.0 && gain.mean >= kLeastGain_db ? "stays" : "goes";
}

/// Of a changed constant, where `gain` is that of the default over it.
const char* constant_verdict(const PairedDifference& gain) {
  constexpr double kNothing_db = 0.1;
  if (std::abs(gain.mean) < kNothing_db) return "no matter";
  return gain.mean > 0.0 ? "worse" : "better";
}

std::string table_of(const std::vector<Cell>& cells, const AblationOptions& o) {
  std::string text = "| rule | scenes | gain (dB) | 95 % interval | gain in power (dB) | least | most | verdict |\n"
                     "|---|--:|--:|--:|--:|--:|--:|---|\n";
  for (const Rule& rule : o.candidates()) {
    const std::vector<double> gains = gains_of(cells, rule.name, false);
    if (gains.empty()) continue;
    const PairedDifference i = paired_difference(gains), power = paired_difference(gains_of(cells, rule.name, true));
    const auto [least, most] = std::ranges::minmax(gains);
    const char* const verdict = o.constants ? constant_verdict(i) : rule_verdict(i, gains.size());
    text += format("| %s | %zu | %+.2f | %+.2f to %+.2f | %+.2f | %+.2f | %+.2f | %s |\n",
                   (rule.text.empty() ? rule.name : rule.text + " (`" + rule.name + "`)").c_str(), gains.size(), i.mean,
                   i.low, i.high, power.mean, least, most, verdict);
  }
  std::map<std::string, std::vector<double>> spread;
  for (const Cell& c : cells)
    if (c.rule == kAll) spread[c.set].push_back(c.score_db());
  text += "\n| scene | seeds | score (dB) | standard deviation over seeds |\n|---|--:|--:|--:|\n";
  for (const auto& [set, scores] : spread) {
    const auto n = static_cast<double>(scores.size());
    double mean = 0.0, squares = 0.0;
    for (const double s : scores) mean += s / n;
    for (const double s : scores) squares += (s - mean) * (s - mean);
    text += format("| %s | %zu | %.2f | %.2f |\n", set.c_str(), scores.size(), mean,
                   n > 1.0 ? std::sqrt(squares / (n - 1.0)) : 0.0);
  }
  return text;
}

std::optional<AblationOptions> parse(int argc, char** argv) {
  using namespace app;
  CommandLine command("sar_bench ablation",
                      "Leaves out each rule and prior of learning alone, and prints what that costs on clean views that were not\n"
                      "learned from: PSNR of power on clean data, of log amplitude on speckle. The unit is the scene. Resumable:\n"
                      "OUTPUT/cells.jsonl has a line for each training, and what is there is not learned again.",
                      "Examples:\n  scripts/ablation.sh makes the data sets and calls this.\nExit codes: 0 done, 1 failure at run time, "
                      "2 usage, 3 bad input file, 130 interrupted.");
  AblationOptions o;
  command.add_list("DATA", o.folders, text("FOLDER"), "Data sets; FOLDER.truth holds the clean views to judge by", {});
  command.require("DATA");
  command.begin_group("Study");
  command.add("-o,--output", o.output, made_by("FOLDER", without_slash), "Folder of the results");
  command.require("-o");
  command.add("--seeds", o.n_seeds, whole("N", 1, 1000), "Seeds 1 to N of each cell");
  command.add("--steps", o.n_steps, whole("N", 0, 1'000'000), "Steps of each training; 0: sar_nerf_train's default");
  command.add_list("--rules", o.only, text("NAME"), "Only these; 'all' is the method with everything", {.one_at_a_time = true});
  command.add_list("--without", o.without, text("NAME"),
                   "Leave these out of every training: the method that is ablated is the one without them", {.one_at_a_time = true});
  command.add_flag("--constants", o.constants, "Instead of leaving out rules, double and halve each constant, alone");
  command.add_flag("--dry-run", o.dry_run, "Print the cells that are missing and stop");
  command.add_shared_options();
  command.then([&] { o.shared = command.shared_options(); });
  if (!command.parse(argc, argv)) return std::nullopt;
  const auto rule_of = [](const std::vector<Rule>& list, const char* option, const std::string& name) {
    const auto rule = std::ranges::find(list, name, &Rule::name);
    if (rule == list.end()) throw UsageError(std::string(option) + ": there is no rule " + in_quotes(name));
    return &*rule;
  };
  for (const std::string& name : o.only)
    if (name != kAll) rule_of(o.candidates(), "--rules", name);
  for (const std::string& name : o.without) o.base.push_back(rule_of(rules(), "--without", name));
  return o;
}

}  // namespace

void run_ablation(int argc, char** argv, app::Console& console) {
  const std::optional<AblationOptions> parsed = parse(argc, argv);
  if (!parsed) return;
  const AblationOptions& o = *parsed;
  console.set_verbosity(o.shared.verbosity);
  const ThreadLimit threads(o.shared.n_threads);
  app::use_torch_threads(thread_count());
  const Monitor monitor{{}, &app::stop_requested()};
  make_folder(o.output);
  const app::FolderLock lock(o.output);
  const fs::path file = o.output / "cells.jsonl";
  std::vector<Cell> cells = cells_of(file);
  std::set<std::tuple<std::string, std::string, int>> done;
  for (const Cell& c : cells) done.insert({c.set, c.rule, c.seed});

  struct Missing {
    std::size_t data_set;
    const Rule* rule;
    int seed;
  };
  std::vector<AblationData> data_sets;
  std::vector<Ablated> bases;
  for (const std::string& folder : o.folders) {
    monitor.check();
    bases.push_back(ablated(data_sets.emplace_back(read(folder, o)), o));
    for (const Cell& c : cells)
      if (c.set == data_sets.back().name && c.method != data_sets.back().method)
        throw UsageError(file.string() + ": its cells of " + c.set + " are of other images, --steps or --without; choose another -o");
  }
  // Seed by seed, so that a study that was interrupted has judged every rule.
  std::vector<Missing> missing;
  for (int seed = 1; seed <= o.n_seeds; ++seed)
    for (std::size_t n = 0; n < data_sets.size(); ++n) {
      const auto add = [&](const Rule* rule, const std::string& name) {
        if (!done.contains({data_sets[n].name, name, seed})) missing.push_back({n, rule, seed});
      };
      add(nullptr, kAll);
      for (const Rule* rule : bases[n].acting) add(rule, rule->name);
    }
  if (o.dry_run) {
    for (const Missing& c : missing)
      app::print_result(data_sets[c.data_set].name + " " + (c.rule ? c.rule->name : kAll) + " " + std::to_string(c.seed) + "\n");
    return;
  }
  std::ofstream out(file, std::ios::app);
  if (ends_within_a_line(file)) out << '\n';
  for (std::size_t n = 0; n < missing.size(); ++n) {
    const Missing& c = missing[n];
    const Cell cell = learn(data_sets[c.data_set], bases[c.data_set].method, c.rule, c.seed, o.n_steps, monitor);
    out << json_of(cell).dump() << std::endl;
    if (!out) throw Error(file.string() + " could not be written; is the disk full?");
    cells.push_back(cell);
    console.note(format("%zu/%zu %s, %s, seed %d: %.2f dB power, %.2f dB log amplitude, %.0f s", n + 1, missing.size(),
                        cell.set.c_str(), (c.rule ? "without " + cell.rule : kAll).c_str(), cell.seed, cell.psnr_power_db,
                        cell.psnr_log_amplitude_db, cell.seconds));
  }
  const std::string table = table_of(cells, o);
  write_file_atomically(o.output / "ablation.md", table);
  app::print_result(table);
}

}  // namespace sarnerf::bench
