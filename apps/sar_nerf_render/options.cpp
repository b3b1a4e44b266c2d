// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <limits>

#include "command_line.h"
#include "nerf_common.h"
#include "output_lock.h"
#include "sarnerf/core/error.h"
#include "values.h"

namespace sarnerf::app {
namespace {

constexpr const char* kDescription =
    "Renders SAR images of a scene that sar_nerf_train has learned, from directions of your "
    "choice, or compares them\n"
    "with a dataset's. One view writes NAME.tif (float32), NAME.png (decibels, for the eye), "
    "NAME.json (how it was\n"
    "made) and NAME.report.json (times); several views a dataset folder, which the same command "
    "continues.";

constexpr const char* kExamples =
    "Examples:\n"
    "  sar_nerf_render cuboid_run --azimuth 12.5 -o view\n"
    "  sar_nerf_render cuboid_run --pitch 45 --azimuth 0:359:1 -o views/\n"
    "  sar_nerf_render cuboid_run --views cuboid_test/ -o predicted/\n"
    "  sar_nerf_render cuboid_run --against cuboid_test/ -o scores/\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 not finite, 130 "
    "interrupted.";

/// Options that --views excludes, because it takes them from the dataset; --against also takes the rest.
const std::vector<std::string> kViewOptions{"--pitch", "--depression", "--azimuth", "--altitude", "--slant-range", "--look",
                                            "--size", "--spacing"};
const std::vector<std::string> kImageOptions{"--quantity", "--resolution", "--window", "--looks", "--seed"};

void refuse_beside(const CommandLine& command, const std::string& source, const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (command.given(name)) throw UsageError(source + " takes its views from the dataset; leave out " + name);
}

void refuse_comparison_alone(const Options& o) {
  const bool looks = o.speckle.kind == SpeckleChoice::Kind::training;
  for (const auto& [given, name] : {std::pair(!o.training.empty() && !looks, "--training"), std::pair(!o.lpips.empty(), "--lpips"),
                                    std::pair(o.despeckle_deg > 0.0, "--despeckle")}) {
    if (given) throw UsageError(std::string(name) + " is of use with --against only; leave it out");
  }
}

Kind<SpeckleChoice> speckle_choice() {
  const auto read = [](const std::string& option, const std::string& text) -> SpeckleChoice {
    if (text == "none") return {};
    if (text == "training") return {SpeckleChoice::Kind::training};
    return {SpeckleChoice::Kind::looks, parse_between(option, text, 1.0, 1000.0)};
  };
  return {"L|training|none", read, [](const SpeckleChoice&) { return std::string("none"); }};
}

void add_options(CommandLine& command, Options& o) {
  command.then([&] {
    o.shared = command.shared_options();
    if (command.given("--views")) refuse_beside(command, "--views", kViewOptions);
    if (!command.given("--against")) return;
    refuse_beside(command, "--against", {"--views"});
    refuse_beside(command, "--against", kViewOptions);
    refuse_beside(command, "--against", kImageOptions);
  });
  command.add("MODEL", o.model, made_by("FILE", without_slash), "model.pt, or the folder of a run");
  command.require("MODEL");

  command.begin_group("Views (angles: 45, a list 15,17 or a range 0:350:10 with its end, if a step meets it)");
  command.add("--pitch", o.incidence_deg, incidences_deg(command),
              "Incidence at the aim point, from the vertical; default: the training views'");
  command.add("--depression", o.incidence_deg, incidences_deg(command), "The same from the horizontal: 90 - pitch");
  command.add("--azimuth", o.azimuth_deg, angles_deg(), "Where the radar stands");
  command.add("--altitude", o.altitude_m, radar_distance_m(command), "Radar above the aim point");
  command.add("--slant-range", o.slant_range_m, radar_distance_m(command),
              "Radar to aim point; default: the training views'");
  command.add("--look", o.look,
              one_of<std::optional<Look>>({{"right", Look::right}, {"left", Look::left}, {"auto", std::nullopt}}),
              "Side to which the radar looks; auto: the training views'");
  command.add("--views", o.views, made_by("FOLDER", dataset_folder),
              "Instead of all these, and of size and spacing: the views of this dataset");

  command.begin_group("Image (auto: as the training images)");
  command.add("--size", o.size, image_size().or_word("auto"), "Pixels, azimuth x range (64: 64x64)");
  command.add("--spacing", o.spacing_m, spacing_m().or_word("auto"), "Pixel spacing (m), azimuth and slant range");
  command.add("--quantity", o.quantity,
              one_of<std::optional<Quantity>>(
                  {{"power", Quantity::power}, {"amplitude", Quantity::amplitude}, {"auto", std::nullopt}}, "NAME"),
              "power, amplitude or auto");
  command.add("--resolution", o.resolution, resolution_choice(),
              "-3 dB widths (m) of the impulse response that views have; auto: the training images'; none: the scene "
              "itself, sharp");
  command.add("--window", o.resolution, window_of(o.resolution),
              "Its window, as for sar_render: none, hann, hamming, taylor:-35, kaiser:6");

  command.add("--looks", o.speckle, speckle_choice(),
              "Speckle of so many looks (1 to 1000); training: with looks and width as in the training images; none: the mean");
  command.add("--seed", o.seed, whole("N", 0, std::numeric_limits<std::int64_t>::max()), "Of the speckle; each view has its own, too");

  command.then([&] {
    if (command.given("--seed") && !command.given("--looks"))
      throw UsageError("--seed is that of the speckle: give --looks, too, or leave it out");
  });

  command.begin_group("Comparison");
  command.add("--against", o.against, made_by("FOLDER", dataset_folder),
              "Predict this dataset's views and print their scores; those trained on are left out");
  command.add("--training", o.training, made_by("FOLDER", dataset_folder),
              "Dataset of the training, for the baselines and --looks training; default: where the model says");
  command.add("--lpips", o.lpips, path("FILE"), "Weights of LPIPS (.safetensors, docs/guide/lpips.md)");
  command.add("--despeckle", o.despeckle_deg, despeckle_degrees(),
              "Compare with averages of unseen views within so many degrees of azimuth, too (docs/guide/metrics.md)");
  command.then([&] {
    if (o.against.empty()) refuse_comparison_alone(o);
  });
  command.read_later(kViewOptions);
  command.read_later(kImageOptions);

  command.begin_group("Output");
  command.add("-o,--output", o.output, text("NAME"), "File name without ending, or folder; default RUN_view, RUN_views");
  command.add_flag("--overwrite", o.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", o.explain, "Print the plan before the work");
  command.add_flag("--dry-run", o.dry_run, "Print the plan and stop: nothing is written");

  command.same_meaning({"pitch", "depression"});
  command.same_meaning({"altitude", "slant-range"});
  command.add_shared_options();
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_nerf_render", kDescription, kExamples);
  Options options;
  add_options(command, options);
  if (!command.parse(argc, argv)) return std::nullopt;
  return options;
}

}  // namespace sarnerf::app
