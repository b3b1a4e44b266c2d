// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <array>
#include <string_view>

#include "command_line.h"
#include "console.h"
#include "output_lock.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/error.h"
#include "values.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr const char* kHelp =
    "Makes dataset folders, as sar_nerf_train reads them, of measured SAR images; and the other "
    "way round.\n"
    "Usage: sar_import COMMAND ... [OPTIONS]\n"
    "\n"
    "Commands:\n"
    "  mstar PATHS...   Phoenix chips of MSTAR: files, or folders that hold such\n"
    "  sample PATHS...  Chips of SAMPLE: .mat files of version 5, or folders that hold such\n"
    "  images FOLDER    Pictures (PNG, JPEG, TIFF) with a table, or with names that carry the "
    "azimuth\n"
    "  phoenix DATASET  Writes the views of a dataset as Phoenix chips, for other tools\n"
    "\n"
    "Examples:\n"
    "  sar_import mstar MSTAR/TARGETS/TEST/15_DEG/2S1 --every 5 --crop 128x128 -o 2s1\n"
    "  sar_import images chips/2S1/17 --csv chips/manifest.csv --amplitude-scale 4/65535 -o 2s1\n"
    "  sar_import phoenix truck_360 -o truck_chips\n"
    "sar_import COMMAND --help lists the options of a command.\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 130 interrupted.\n";

constexpr const char* kExitCodes =
    "Azimuths are TargetAz: at 0 the radar stands over +Z, and towards +X as it grows "
    "(docs/method/conventions.md).\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 130 interrupted.";

constexpr std::array kCommands{Command::mstar, Command::sample, Command::images, Command::phoenix};

const char* description(Command command) {
  switch (command) {
    case Command::mstar:
      return "Makes a dataset folder of MSTAR's Phoenix chips: amplitudes, measured depressions "
             "and ranges.";
    case Command::sample:
      return "Makes a dataset folder of SAMPLE's chips: .mat files of version 5, amplitudes, "
             "measured depressions.";
    case Command::images:
      return "Makes a dataset folder of pictures whose angles are listed in a table (columns file, "
             "azimuth_deg; if known\n"
             "depression_deg or incidence_deg, slant_range_m, azimuth_spacing_m, range_spacing_m, "
             "class, serial,\n"
             "split), or whose names begin with the azimuth, as 50.2248_HB15087.tif.";
    case Command::phoenix:
      return "Writes the views of a dataset as Phoenix chips (amplitudes, phases 0), which tools "
             "for MSTAR read.";
  }
  return "";
}

/// As angles_deg(), but refuses angles outside 0 to 90 degrees (both excluded).
Kind<std::vector<double>> depressions_deg() {
  return angles_deg().checked([](auto&, auto& text) { (void)incidences_deg("", text); });
}

void add_inputs(CommandLine& command, Options& o) {
  if (o.command == Command::mstar || o.command == Command::sample) {
    command.add_list("PATHS", o.inputs, made_by("PATH", without_slash), "Files, or folders with such files at any depth",
                     {.most = 1'000'000});
    command.require("PATHS");
    return;
  }
  o.inputs.resize(1);
  const bool pictures = o.command == Command::images;
  const char* const name = pictures ? "FOLDER" : "DATASET";
  command.add(name, o.inputs.front(), made_by("FOLDER", without_slash),
              pictures ? "Folder with images at any depth" : "Folder with dataset.json");
  command.require(name);
}

void add_image_options(CommandLine& command, Options& o) {
  command.begin_group("Images");
  command.add("--csv", o.table, path("FILE"), "Table of the images; only those below FOLDER are taken");
  command.add("--spacing", o.spacing_m, spacing_m(), "Pixel spacing (m), azimuth and slant range, where the table has none");
  command.add("--amplitude-scale", o.scale, code_value(), "Value of one code of the files, such as 4/65535");
  command.add("--quantity", o.quantity,
              one_of<Quantity>({{"amplitude", Quantity::amplitude}, {"power", Quantity::power}}, "NAME"),
              "What the files hold: amplitude or power");
  command.add("--orientation", o.orientation,
              one_of<Orientation>({{"chip", Orientation::chip}, {"radar", Orientation::radar}}),
              "chip: rows from far to near range, radar below; radar: rows azimuth, columns range");
}

void add_selection_options(CommandLine& command, Options& o) {
  command.begin_group("Which images");
  command.add("--class", o.selection.class_name, text("NAME"),
              "Only this class; or, where no class is known, that it is this one");
  command.add("--depression", o.selection.depression_deg, depressions_deg(),
              "Only these nominal depressions (17 or 15,17); or, where none is known, that it is this "
              "one");
  command.add("--every", o.selection.every_deg, between("DEG", 0.01, 180.0).or_word("none"),
              "Only the images nearest to azimuths 0, DEG, 2 DEG ...");
  command.add("--crop", o.selection.crop, image_size().or_word("none"), "Keep the middle, azimuth x range pixels");
  command.add("--slant-range", o.slant_range_m, between("M", kNearestRadar_m, kFarthestRadar_m),
              "Radar to target where no file says it; recorded as assumed");
}

void resolve_output(Options& o) {
  if (o.output.empty()) {
    std::error_code ignored;
    const auto first = std::filesystem::weakly_canonical(o.inputs.front(), ignored);
    o.output = first.stem().string() + (o.command == Command::phoenix ? "_phoenix" : "_dataset");
  }
  o.output = without_slash(o.output);
}

void add_options(CommandLine& command, Options& o) {
  command.then([&] { o.shared = command.shared_options(); });
  add_inputs(command, o);
  if (o.command == Command::images) add_image_options(command, o);
  if (o.command != Command::phoenix) add_selection_options(command, o);
  command.read_later({"--spacing", "--amplitude-scale"});
  command.begin_group("Output");
  command.add("-o,--output", o.output, path("FOLDER"),
              o.command == Command::phoenix ? "Folder of the chips; default DATASET_phoenix"
                                            : "Dataset folder; default NAME_dataset");
  command.add_flag("--overwrite", o.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", o.explain, "Print the plan before the work");
  command.add_flag("--dry-run", o.dry_run, "Print the plan and stop");
  command.then([&] {
    o.explain = o.explain || o.dry_run;
    resolve_output(o);
  });
  command.add_shared_options();
}

[[noreturn]] void refuse_command(const std::string& text) {
  std::vector<std::string> names;
  for (const Command command : kCommands) names.emplace_back(name(command));
  const std::string close = closest_name(text, names);
  throw UsageError("unknown command '" + visible(text) + "'" +
                   (close.empty() ? "" : " (" + close + "?)") +
                   "; expected mstar, sample, images or phoenix; sar_import --help describes them");
}

}  // namespace

std::string_view name(Command command) {
  constexpr std::array<std::string_view, 4> kNames{"mstar", "sample", "images", "phoenix"};
  return kNames[static_cast<std::size_t>(command)];
}

std::string_view name(Orientation orientation) {
  return orientation == Orientation::chip ? "chip" : "radar";
}

std::optional<Options> parse_options(int argc, char** argv) {
  if (argc < 2)
    throw UsageError(
        "a command is needed: mstar, sample, images or phoenix; sar_import --help describes them");
  const std::string_view first = argv[1];
  if (first == "--help" || first == "-h") {
    print_result(kHelp);
    return std::nullopt;
  }
  if (first == "--version") {
    print_result(std::string(kProgram) + " " + std::string(kVersion) + "\n");
    return std::nullopt;
  }
  for (const Command command : kCommands) {
    if (first != name(command)) continue;
    CommandLine line(std::string(kProgram) + " " + std::string(first), description(command), kExitCodes);
    Options options;
    options.command = command;
    add_options(line, options);
    if (!line.parse(argc - 1, argv + 1)) return std::nullopt;
    return options;
  }
  refuse_command(std::string(first));
}

}  // namespace sarnerf::app
