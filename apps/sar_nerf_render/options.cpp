// SPDX-License-Identifier: Apache-2.0
#include "job.h"

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
    "  sar_nerf_render cuboid_run --against cuboid_test/ -o scores/\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 not finite, 130 "
    "interrupted.";

struct Texts {
  std::string model, pitch, depression, azimuth = "0", altitude, slant_range, look = "auto";
  std::string size = "auto", spacing = "auto", quantity = "auto", resolution = "auto", window;
  std::string against, training, lpips, despeckle = "off", output;
  bool overwrite = false, explain = false, dry_run = false;
};

void add_options(CommandLine& command, Texts& t) {
  CLI::App& p = command.parser();
  const auto add = [&](const char* name, std::string& text, const char* type, const char* help) {
    return command.add_text_option(name, text, type, help);
  };
  p.add_option("MODEL", t.model, "model.pt, or the folder of a run")->type_name("FILE")->required();

  command.begin_group("Views (angles: 45, a list 15,17 or a range 0:350:10 with its end, if a step meets it)");
  add("--pitch", t.pitch, "DEG",
      "Incidence at the aim point, from the vertical; default: the training views'");
  add("--depression", t.depression, "DEG", "The same from the horizontal: 90 - pitch");
  add("--azimuth", t.azimuth, "DEG", "Where the radar stands");
  add("--altitude", t.altitude, "M", "Radar above the aim point");
  add("--slant-range", t.slant_range, "M", "Radar to aim point; default: the training views'");
  add("--look", t.look, "right|left|auto",
      "Side to which the radar looks; auto: the training views'")
      ->check(one_of({"right", "left", "auto"}));

  command.begin_group("Image (auto: as the training images)");
  add("--size", t.size, "AxR|auto", "Pixels, azimuth x range (64: 64x64)");
  add("--spacing", t.spacing, "A[,R]|auto", "Pixel spacing (m), azimuth and slant range");
  add("--quantity", t.quantity, "NAME", "power, amplitude or auto")
      ->check(one_of({"power", "amplitude", "auto"}));
  add("--resolution", t.resolution, "A[,R]|auto|none",
      "-3 dB widths (m) of the impulse response that views have; auto: the training images'; none: the scene itself, sharp");
  add("--window", t.window, "NAME", "Its window, as for sar_render: none, hann, hamming, taylor:-35, kaiser:6");

  command.begin_group("Comparison");
  add("--against", t.against, "FOLDER",
      "Predict this dataset's views and print their scores; those trained on are left out");
  add("--training", t.training, "FOLDER",
      "Dataset of the training, for the baselines; default: where the model says");
  add("--lpips", t.lpips, "FILE", "Weights of LPIPS (.safetensors, docs/lpips.md)");
  add("--despeckle", t.despeckle, "DEG|off",
      "Compare with averages of unseen views within so many degrees of azimuth, too (docs/metrics.md)");

  command.begin_group("Output");
  add("-o,--output", t.output, "NAME",
      "File name without ending, or folder; default RUN_view, RUN_views");
  command.add_flag("--overwrite", t.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", t.explain, "Print the plan before the work");
  command.add_flag("--dry-run", t.dry_run, "Print the plan and stop: nothing is written");

  command.same_meaning({"pitch", "depression"});
  command.same_meaning({"altitude", "slant-range"});
  command.add_shared_options();
  p.footer(kExamples);
}

/// A comparison takes its views from the dataset.
void refuse_views_beside_against(const CommandLine& command) {
  auto& parser = const_cast<CommandLine&>(command).parser();
  for (const char* name : {"--pitch", "--depression", "--azimuth", "--altitude", "--slant-range",
                           "--look", "--size", "--spacing", "--quantity", "--resolution", "--window"}) {
    if (parser.get_option(name)->count() > 0)
      throw UsageError(std::string("--against takes its views from the dataset; leave out ") +
                       name);
  }
}

Options resolve(const Texts& t, const CommandLine& command) {
  Options o;
  o.shared = command.shared_options();
  o.model = without_slash(t.model);
  o.against = dataset_folder(t.against);
  o.training = dataset_folder(t.training);
  o.lpips = t.lpips;
  if (!o.against.empty()) refuse_views_beside_against(command);
  o.despeckle_deg = parse_despeckle_deg(t.despeckle);
  if (o.against.empty()) {
    for (const auto& [given, name] : {std::pair(!o.training.empty(), "--training"),
                                      std::pair(!o.lpips.empty(), "--lpips"),
                                      std::pair(o.despeckle_deg > 0.0, "--despeckle")}) {
      if (given)
        throw UsageError(std::string(name) + " is of use with --against only; leave it out");
    }
  }
  o.incidence_deg = incidences_deg(t.pitch, t.depression);
  o.azimuth_deg = parse_angles_deg("--azimuth", t.azimuth);
  if (!t.altitude.empty() && !t.slant_range.empty())
    throw UsageError("--altitude and --slant-range both place the radar; give one of them");
  if (!t.altitude.empty())
    o.altitude_m = parse_between("--altitude", t.altitude, kNearestRadar_m, kFarthestRadar_m);
  if (!t.slant_range.empty())
    o.slant_range_m =
        parse_between("--slant-range", t.slant_range, kNearestRadar_m, kFarthestRadar_m);
  if (t.look != "auto") o.look = t.look == "left" ? Look::left : Look::right;
  if (t.size != "auto") o.size = parse_image_size("--size", t.size);
  if (t.spacing != "auto") o.spacing_m = parse_spacing_m("--spacing", t.spacing);
  if (t.quantity != "auto") o.quantity = quantity_from_name(t.quantity);
  o.resolution = parse_resolution(t.resolution, t.window);
  o.output = t.output;
  o.overwrite = t.overwrite;
  o.explain = t.explain;
  o.dry_run = t.dry_run;
  return o;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_nerf_render", kDescription);
  Texts texts;
  add_options(command, texts);
  if (!command.parse(argc, argv)) return std::nullopt;
  return resolve(texts, command);
}

}  // namespace sarnerf::app
