// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <array>
#include <string_view>

#include "command_line.h"
#include "console.h"
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
    "(docs/conventions.md).\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 130 interrupted.";

constexpr std::array kCommands{Command::mstar, Command::sample, Command::images, Command::phoenix};

struct Texts {
  std::vector<std::string> inputs;
  std::string output, class_name, depression, every = "none", crop = "none", slant_range = "4500";
  std::string table, spacing, scale = "1", quantity = "amplitude", orientation = "chip";
  bool overwrite = false, explain = false, dry_run = false;
};

const char* description(Command command) {
  switch (command) {
    case Command::mstar:
      return "Makes a dataset folder of MSTAR's Phoenix chips: amplitudes, measured depressions "
             "and ranges.";
    case Command::sample:
      return "Makes a dataset folder of SAMPLE's chips: .mat files of version 5, amplitudes, "
             "measured depressions.";
    case Command::images:
      return "Makes a dataset folder of pictures whose angles a table knows (columns file, "
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

void add_input(CommandLine& command, Command what, Texts& t) {
  const bool many = what == Command::mstar || what == Command::sample;
  const char* const name = many ? "PATHS" : what == Command::images ? "FOLDER" : "DATASET";
  const char* const help = many ? "Files, or folders with such files at any depth"
                           : what == Command::images ? "Folder with images at any depth"
                                                     : "Folder with dataset.json";
  CLI::Option* option = command.parser().add_option(name, t.inputs, help)->required();
  option->type_name(many ? "PATH" : "FOLDER")->expected(1, many ? 1'000'000 : 1);
}

void add_options(CommandLine& command, Command what, Texts& t) {
  const auto add = [&](const char* name, std::string& text, const char* type, const char* help) {
    return command.add_text_option(name, text, type, help);
  };
  add_input(command, what, t);
  if (what == Command::images) {
    command.begin_group("Images");
    add("--csv", t.table, "FILE", "Table of the images; only those below FOLDER are taken");
    add("--spacing", t.spacing, "A[,R]",
        "Pixel spacing (m), azimuth and slant range, where the table has none");
    add("--amplitude-scale", t.scale, "X|X/Y", "Value of one code of the files, such as 4/65535");
    add("--quantity", t.quantity, "NAME", "What the files hold: amplitude or power")
        ->check(one_of({"amplitude", "power"}));
    add("--orientation", t.orientation, "chip|radar",
        "chip: rows from far to near range, radar below; radar: rows azimuth, columns range")
        ->check(one_of({"chip", "radar"}));
  }
  if (what != Command::phoenix) {
    command.begin_group("Which images");
    add("--class", t.class_name, "NAME",
        "Only this class; or, where no class is known, that it is this one");
    add("--depression", t.depression, "DEG",
        "Only these nominal depressions (17 or 15,17); or, where none is known, that it is this "
        "one");
    add("--every", t.every, "DEG|none", "Only the images nearest to azimuths 0, DEG, 2 DEG ...");
    add("--crop", t.crop, "AxR|none", "Keep the middle, azimuth x range pixels");
    add("--slant-range", t.slant_range, "M",
        "Radar to target where no file says it; recorded as assumed");
  }
  command.begin_group("Output");
  add("-o,--output", t.output, "FOLDER",
      what == Command::phoenix ? "Folder of the chips; default DATASET_phoenix"
                               : "Dataset folder; default NAME_dataset");
  command.add_flag("--overwrite", t.overwrite,
                   "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", t.explain, "Print the plan before the work");
  command.add_flag("--dry-run", t.dry_run, "Print the plan and stop");
  command.add_shared_options();
  command.parser().footer(kExitCodes);
}

double parse_scale(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) return parse_positive("--amplitude-scale", text);
  return parse_positive("--amplitude-scale", text.substr(0, slash)) /
         parse_positive("--amplitude-scale", text.substr(slash + 1));
}

Selection resolve_selection(const Texts& t) {
  Selection s;
  s.class_name = t.class_name;
  if (!t.depression.empty()) {
    (void)incidences_deg("", t.depression);  // refuses angles that no view can have
    s.depression_deg = parse_angles_deg("--depression", t.depression);
  }
  if (t.every != "none") s.every_deg = parse_between("--every", t.every, 0.01, 180.0);
  if (t.crop != "none") s.crop = parse_image_size("--crop", t.crop);
  return s;
}

Options resolve(const Texts& t, Command command, const CommandLine& line) {
  Options o;
  o.shared = line.shared_options();
  o.command = command;
  for (const std::string& input : t.inputs) {
    const std::filesystem::path path = input;
    o.inputs.push_back(path.has_filename() ? path : path.parent_path());
  }
  o.selection = resolve_selection(t);
  o.slant_range_m =
      parse_between("--slant-range", t.slant_range, kNearestRadar_m, kFarthestRadar_m);
  o.table = t.table;
  if (!t.spacing.empty()) o.spacing_m = parse_spacing_m("--spacing", t.spacing);
  o.scale = parse_scale(t.scale);
  o.quantity = quantity_from_name(t.quantity);
  o.orientation = t.orientation == "radar" ? Orientation::radar : Orientation::chip;
  std::error_code ignored;
  const auto first = std::filesystem::weakly_canonical(o.inputs.front(), ignored);
  o.output = t.output.empty()
                 ? first.stem().string() + (command == Command::phoenix ? "_phoenix" : "_dataset")
                 : t.output;
  if (!o.output.has_filename()) o.output = o.output.parent_path();
  o.overwrite = t.overwrite;
  o.explain = t.explain || t.dry_run;
  o.dry_run = t.dry_run;
  return o;
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
    CommandLine line(std::string(kProgram) + " " + std::string(first), description(command));
    Texts texts;
    add_options(line, command, texts);
    if (!line.parse(argc - 1, argv + 1)) return std::nullopt;
    return resolve(texts, command, line);
  }
  refuse_command(std::string(first));
}

}  // namespace sarnerf::app
