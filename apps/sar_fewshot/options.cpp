// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include "command_line.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf::app {
namespace {

constexpr const char* kDescription =
    "Few-shot recognition: how much better is a classifier that learns from a few measured chips of each class and from\n"
    "views generated from them? Trains classifiers on shots at one depression and tests them on all chips at another.";

constexpr const char* kFooter =
    "Examples:\n"
    "  sar_fewshot mstar/soc --csv mstar/manifest.csv --amplitude-scale 4/65535 -o study\n"
    "  sar_fewshot mstar/soc --csv mstar/manifest.csv --amplitude-scale 4/65535 --quick -o quick\n"
    "  sar_fewshot chips/ --train-depression 17 --test-depression 15 --shots 4,8 --draws 3\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 a training diverged, 130 interrupted; the same\n"
    "command continues.";

/// A list of some of these values, separated by commas, each named by name().
template <class T>
Kind<std::vector<T>> some_of(const std::vector<T>& all) {
  const auto read = [all](const std::string& option, const std::string& text) {
    std::vector<T> chosen;
    std::vector<std::string> names;
    for (const T value : all) names.emplace_back(name(value));
    for (const std::string& part : parts_of(text)) {
      const auto found = std::ranges::find(names, part);
      if (found == names.end()) {
        const std::string close = closest_name(part, names);
        std::string list;
        for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
        throw UsageError(option + ": expected some of " + list + ", found " + in_quotes(part) + (close.empty() ? "" : " (" + close + "?)"));
      }
      const T value = all[static_cast<std::size_t>(found - names.begin())];
      if (std::ranges::find(chosen, value) != chosen.end()) throw UsageError(option + ": " + in_quotes(part) + " is given twice");
      chosen.push_back(value);
    }
    if (chosen.empty()) throw UsageError(option + ": expected a list, found nothing");
    return chosen;
  };
  const auto show = [](const std::vector<T>& values) {
    std::string text;
    for (const T value : values) text += (text.empty() ? "" : ",") + std::string(name(value));
    return text;
  };
  return {"LIST", read, show};
}

Kind<std::vector<int>> shot_counts() {
  const auto read = [](const std::string& option, const std::string& text) {
    std::vector<int> counts;
    for (const std::string& part : parts_of(text)) {
      const int n = part == "all" ? 0 : static_cast<int>(parse_whole(option + " (or all)", part, 1, 100'000));
      if (std::ranges::find(counts, n) != counts.end()) throw UsageError(option + ": " + in_quotes(part) + " is given twice");
      counts.push_back(n);
    }
    if (counts.empty()) throw UsageError(option + ": expected numbers such as 4,8,12 or all, found nothing");
    return counts;
  };
  const auto show = [](const std::vector<int>& counts) {
    std::string text;
    for (const int n : counts) text += (text.empty() ? "" : ",") + (n == 0 ? std::string("all") : std::to_string(n));
    return text;
  };
  return {"LIST", read, show};
}

std::filesystem::path folder_of_chips(const std::string& text) {
  if (!std::filesystem::is_directory(text)) throw InputError(text + ": expected a folder of chips, found none");
  return without_slash(text);
}

void add_options(CommandLine& command, Options& o, bool& quick) {
  command.then([&] { o.shared = command.shared_options(); });
  command.add("FOLDER", o.chips, made_by("FOLDER", folder_of_chips), "Folder with datasets of chips, or with images of a table, at any depth");
  command.require("FOLDER");

  command.begin_group("Chips");
  command.add("--csv", o.table, path("FILE"), "Table of images, as for sar_import: file, azimuth_deg, depression_deg, class, spacings");
  command.add("--amplitude-scale", o.scale, code_value(), "Amplitude of one code of the files, such as 4/65535");
  command.add("--spacing", o.spacing_m, spacing_m(), "Pixel spacing (m), azimuth and slant range, where the table has none");
  command.add("--classes", o.classes, made_by("LIST", parts_of, "all"), "Only these classes");
  command.add("--train-depression", o.training_depression_deg, between("DEG", 1.0, 89.0), "Nominal depression of the shots");
  command.add("--test-depression", o.test_depression_deg, between("DEG", 1.0, 89.0), "Nominal depression of the test chips");

  command.begin_group("Study");
  command.add("--shots", o.shots, shot_counts(), "Shots of each class; all: every chip");
  command.add("--draws", o.n_draws, whole("N", 1, 1000), "Draws of shots: each has starts and a seed of its own");
  command.add_flag("--same-azimuths", o.same_azimuths, "Shots of all classes at the same azimuths, as near as their chips allow; default: a random start for each class");
  std::string arms = "What is added to the shots: ";
  for (const Arm arm : kArms) arms += (arm == kArms[0] ? "" : ", ") + std::string(name(arm));
  command.add("--arms", o.arms, some_of<Arm>({std::begin(kArms), std::end(kArms)}), arms.c_str());
  command.add("--classifiers", o.classifiers,
              some_of<Classifier>({Classifier::a_convnet, Classifier::resnet50, Classifier::nearest_neighbour, Classifier::background}),
              "Of a-convnet, resnet50, nearest and background");
  command.add_flag("--quick", quick, "Four classes, 12 shots, one draw, the arms none, turned and learned, short trainings: about five minutes, to see what there is");
  command.add_flag("--validate", o.validate,
                   "Test on every fourth sector of 30 deg of the training depression, which hold no shots: to choose options by");

  command.add_flag("--test-rest", o.test_rest,
                   "Test classes without chips at the test depression on their training chips that are no shots");
  command.add_flag("--exchange-clutter", o.exchange, "Test on chips with the background of other test chips, too");
  command.add_flag("--check-clutter", o.check_clutter,
                   "Compare the background of measured and of learned chips, and stop: can a network tell them apart?");

  command.add_flag("--check-ground", o.check_ground,
                   "Compare the background of test and of training chips, and stop: do they show the same ground?");

  command.then([&] {
    for (const char* option : {"--amplitude-scale", "--spacing"})
      if (o.table.empty() && command.given(option))
        throw UsageError(std::string(option) + ": is for images of a table (--csv); datasets have their own");
    if (!command.given("--classifiers") && std::ranges::find(o.arms, Arm::none) == o.arms.end())
      std::erase(o.classifiers, Classifier::background);  // it learns from the shots alone
    if (!quick) return;
    if (!command.given("--classes")) o.most_classes = 4;
    if (!command.given("--shots")) o.shots = {12};
    if (!command.given("--draws")) o.n_draws = 1;
    if (!command.given("--arms")) o.arms = {Arm::none, Arm::turned, Arm::learned};
    if (!command.given("--steps")) o.training.n_steps = 200;
    if (!command.given("--field-steps")) o.generation.field_steps = 100;
  });

  command.begin_group("Classifiers");
  command.add("--steps", o.training.n_steps, whole("N", 1, 1'000'000), "Steps of a training");
  command.add("--batch", o.training.batch, whole("N", 2, 10'000), "Chips of a step");
  command.add("--rate", o.training.rate, positive("X"), "Largest learning rate; --check-clutter has its own");
  command.add("--weight-decay", o.training.weight_decay, between("X", 0.0, 1.0), "Of AdamW");
  command.add("--label-smoothing", o.training.label_smoothing, between("X", 0.0, 0.9), "Part of a label that is spread over all classes");
  command.add("--shift", o.training.shift_pixels, whole("N", 0, 8), "Largest random shift of a chip (pixels)");
  command.add("--shot-fraction", o.training.shot_fraction, between("X", 0.0, 1.0), "Part of a batch that is shots");

  command.begin_group("Generated chips");
  command.add("--step", o.generation.step_deg, between("DEG", 0.1, 90.0), "Between generated chips");
  command.add("--reach", o.generation.reach_deg, between("DEG", 0.1, 180.0), "Largest distance from a shot; half the gap at most");
  command.add("--interpolation", o.generation.interpolation,
              one_of<Interpolation>({{"linear", Interpolation::linear}, {"rotated-linear", Interpolation::rotated_linear},
                                     {"rotated-mean", Interpolation::rotated_mean}}),
              "How interpolated chips are made of neighbouring shots");
  command.add("--generate-depression", o.generation.depression_deg, between("DEG", 1.0, 89.0),
              "Depression of rescaled, interpolated, learned and corrected chips; default: that of the shots");
  command.add("--field", o.generation.field, one_of<std::string>({{"grid", "grid"}, {"surface", "surface"}}), "Field that is learned from the shots: grid or surface (five times as long)");
  command.add("--field-steps", o.generation.field_steps, whole("N", 1, 1'000'000), "Steps of its training");
  command.add("--speckle", o.generation.speckle, one_of<Speckle>({{"shots", Speckle::shots}, {"nearest", Speckle::nearest_shot}, {"off", Speckle::none}}),
              "Clutter of learned views: the backgrounds of shots of the class, mirrored at random; that of the nearest shot, turned; or none");

  command.begin_group("Output");
  command.add("-o,--output", o.output, made_by("FOLDER", without_slash), "Folder of the study; default FOLDER_fewshot");
  command.add("--export", o.chips_folder, made_by("FOLDER", without_slash),
              "Write the chips of all draws and arms there, for your own classifiers, and train none");
  command.add("--export-draws", o.draws_folder, made_by("FOLDER", without_slash),
              "Write a file for each draw there, for sar_recognise (on a machine with a GPU), and train no classifier");
  command.add_flag("--dry-run", o.dry_run, "Print the plan and stop");
  command.add_shared_options();
}

/// Throws UsageError for arms and classifiers that do not go together.
void require_sense(const Options& o) {
  const auto has = [](const auto& list, auto value) { return std::ranges::find(list, value) != list.end(); };
  if (has(o.arms, Arm::rescaled) && !o.generation.depression_deg)
    throw UsageError("--arms rescaled: expected a depression to rescale to (--generate-depression), found none");
  if (has(o.arms, Arm::measured) && o.test_rest)
    throw UsageError("--arms measured: its chips would be those that --test-rest tests; leave out one of them");
  if (o.validate && o.test_rest) throw UsageError("--validate: tests all classes at the depression of the shots; leave out --test-rest");
  if (o.check_clutter && (o.generation.depression_deg || o.test_rest || o.generation.speckle != Speckle::shots))
    throw UsageError("--check-clutter: compares clutter of learned chips with that of measured ones at the same azimuths and depression; leave out "
                     "--generate-depression, --test-rest and --speckle");
  if (o.check_clutter && has(o.shots, 0))
    throw UsageError("--check-clutter: expected a number of shots (--shots), found all: nothing would be generated");
  if (o.check_ground && (o.validate || o.check_clutter))
    throw UsageError("--check-ground: compares chips of both depressions, and nothing else; leave out --validate and --check-clutter");
  if (has(o.classifiers, Classifier::background) && !has(o.arms, Arm::none))
    throw UsageError("--classifiers background: learns from the shots alone; add none to --arms");
  const bool interpolates = has(o.arms, Arm::interpolated) || has(o.arms, Arm::interpolated_turned);
  if (o.generation.depression_deg && interpolates && o.generation.interpolation == Interpolation::linear)
    throw UsageError("--interpolation linear: does not rescale to --generate-depression; choose another one");
  if ((o.check_clutter || o.check_ground) && !(o.chips_folder.empty() && o.draws_folder.empty()))
    throw UsageError("--export, --export-draws: write chips and do nothing else; leave out --check-clutter and --check-ground");
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_fewshot", kDescription, kFooter);
  Options options;
  bool quick = false;
  add_options(command, options, quick);
  if (!command.parse(argc, argv)) return std::nullopt;
  require_sense(options);
  if (options.output.empty()) options.output = full_path(options.chips).filename().string() + "_fewshot";
  return options;
}

}  // namespace sarnerf::app
