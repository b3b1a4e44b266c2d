// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <cmath>
#include <limits>
#include <map>
#include <system_error>

#include "command_line.h"
#include "output_files.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "values.h"

namespace sarnerf::app {

namespace {

constexpr const char* kDescription =
    "Renders synthetic aperture radar images of a mesh: single-bounce, incoherent power (beta0).\n"
    "World: metres, Y up. Azimuth 0: the radar stands over +Z; it grows towards +X.\n"
    "One view writes NAME.tif (float32), NAME.png (decibels, for the eye), NAME.json (how it was made)\n"
    "and NAME.report.json (times). Several views write a dataset folder, which the same command\n"
    "continues after an interruption. Rows are azimuth, columns slant range, near range left.";

constexpr const char* kExamples =
    "Examples:\n"
    "  sar_render mine.obj --pitch 45 --units cm --up z --spacing 0.1\n"
    "  sar_render data/truck.obj --depression 17 --azimuth 0:359:1 --spacing 0.1 --size 128x256 -o truck\n"
    "  sar_render data/street.json --pitch 35:55:5 --azimuth 0,90 --explain\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 not finite, 130 interrupted.";

/// Tolerances of --error: below the least, single precision and the deposit's own tolerance show.
constexpr double kLeastTolerance = 0.001, kMostTolerance = 0.2;

/// The texts of all options, as given.
struct Texts {
  std::string scene;
  std::string pitch, depression, azimuth = "0", altitude = "10000", slant_range, look = "right", aim = "auto";
  std::string size = "auto", spacing = "0.3", calibration = "beta0", quantity = "power";
  std::string units = "m", scale = "1", up = "y", materials, ground, ground_height = "auto";
  std::string resolution, window = "none", looks = "inf", nesz = "none", seed = "1";
  std::string engine = "auto", voxel_size = "auto", extinction_per_density = "1", save_volume, error, elevations = "auto", sub_rows = "auto", integrator = "exact";
  std::string layers = "none", output;
  bool overwrite = false, explain = false, dry_run = false;
};

void add_options(CommandLine& command, Texts& t) {
  CLI::App& p = command.parser();
  const auto add = [&](const char* name, std::string& text, const char* type, const char* help) {
    return command.add_text_option(name, text, type, help);
  };

  p.add_option("SCENE", t.scene, "Mesh (.obj, .ply, .stl, .off), scene (.json) or volume (.vdb)")
      ->type_name("FILE")->required();

  command.begin_group("Views (angles: 45, a list 15,17 or a range 0:350:10 with its end, if a step meets it)");
  add("--pitch", t.pitch, "DEG", "Incidence at the aim point, from the vertical; 0 < DEG < 90");
  add("--depression", t.depression, "DEG", "The same from the horizontal: 90 - pitch");
  add("--azimuth", t.azimuth, "DEG", "Where the radar stands");
  add("--altitude", t.altitude, "M", "Radar above the aim point");
  add("--slant-range", t.slant_range, "M", "Radar to aim point, instead of --altitude");
  add("--look", t.look, "right|left", "Side to which the radar looks")
      ->check(one_of({"right", "left"}));
  add("--aim", t.aim, "X,Y,Z|auto", "Aim point (m); auto: horizontal centre at the lowest height");

  command.begin_group("Image");
  add("--size", t.size, "AxR|auto", "Pixels, azimuth x range (64: 64x64); auto: scene, layover, shadow");
  add("--spacing", t.spacing, "A[,R]", "Pixel spacing (m), azimuth and slant range");
  add("--calibration", t.calibration, "NAME", "beta0, sigma0 or gamma0")
      ->check(one_of({"beta0", "sigma0", "gamma0"}));
  add("--quantity", t.quantity, "NAME", "power, or amplitude: its root")
      ->check(one_of({"power", "amplitude"}));

  command.begin_group("Image formation (off by default: images are mean incoherent power)");
  add("--resolution", t.resolution, "A[,R]", "-3 dB widths (m) of the impulse response, coarser than --spacing");
  add("--window", t.window, "NAME", "none, hann, hamming, taylor:DB[,NBAR] as taylor:-35, kaiser:BETA");
  add("--looks", t.looks, "L|inf", "Gamma speckle of L >= 1 looks of the full resolution; inf: none");
  add("--nesz", t.nesz, "DB|none", "Noise floor: noise-equivalent sigma0");
  add("--seed", t.seed, "N", "Of speckle and noise");

  command.begin_group("Scene (units, scale and up of a mesh file; a scene file says them for each of its meshes)");
  add("--units", t.units, "UNIT", "Of the file: m, cm, mm, km, ft, in, or metres as a number");
  add("--scale", t.scale, "FACTOR", "Extra factor on the file's coordinates");
  add("--up", t.up, "y|z", "Axis that points up in the file")->check(one_of({"y", "z"}));
  add("--materials", t.materials, "FILE", "Materials (.json) on top of the built-in ones");
  add("--ground", t.ground, "MATERIAL|none", "Ground plane; default: what a scene file says, else none");
  add("--ground-height", t.ground_height, "M|auto", "Reference plane and ground; auto: lowest height");

  command.begin_group("Computation");
  add("--engine", t.engine, "auto|surface|voxel",
      "surface: rays against the mesh; voxel: rays through sparse voxels; auto: says which and why")
      ->check(one_of({"auto", "surface", "voxel"}));
  add("--voxel-size", t.voxel_size, "M|auto", "Voxels made from a mesh; auto: half the finer spacing");
  add("--extinction-per-density", t.extinction_per_density, "1/M",
      "Of fog volumes (.vdb) made by other tools");
  add("--save-volume", t.save_volume, "FILE", "Write the voxels to FILE (.vdb)");
  add("--error", t.error, "E", "Sample just as finely as this needs: 1% or 0.01 of the image's norm, by its own estimate");
  add("--elevations", t.elevations, "N|auto", "Elevation rays; auto: from the spacing");
  add("--sub-rows", t.sub_rows, "N|auto", "Slices per azimuth row");
  add("--integrator", t.integrator, "NAME",
      "Of translucent matter and voxels: exact; midpoint and paper (an older, darker sum) to compare "
      "with; paper-gated: what the paper of SAR-NeRF trains");

  command.begin_group("Output");
  add("--layers", t.layers, "LIST|all|none",
      "Beside the image: ground, wall, roof, other, mask, incidence, elevation, scatterers, error");
  add("-o,--output", t.output, "NAME", "File name without ending, or folder; default SCENE_sar");
  command.add_flag("--overwrite", t.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", t.explain, "Print the plan before the work: rays, bytes, seconds, what is left out");
  command.add_flag("--dry-run", t.dry_run, "Print the plan and stop");

  command.same_meaning({"pitch", "depression"});
  command.same_meaning({"altitude", "slant-range"});
  command.add_shared_options();
  p.footer(kExamples);
}

std::vector<double> resolve_incidence_deg(const Texts& t) {
  if (t.pitch.empty() && t.depression.empty()) {
    throw UsageError("--pitch (from the vertical) or --depression (from the horizontal) is needed, such "
                     "as --pitch 45");
  }
  return incidences_deg(t.pitch, t.depression);
}

/// A direction given twice, as by 0:360:10, would be an image made twice, and in a split perhaps one on each side.
void drop_repeated(const std::string& option, std::vector<double>& angles_deg, std::vector<std::string>& warnings) {
  std::map<double, double> kept;  // within one turn, as given
  std::size_t n_dropped = 0;
  std::string example;
  std::erase_if(angles_deg, [&](double angle) {
    const auto [same, fresh] = kept.emplace(angle - 360.0 * std::floor(angle / 360.0), angle);
    if (!fresh && n_dropped++ == 0) {
      const bool depression = option == "--depression";
      example = format("%.10g and %.10g degrees are the same direction", depression ? 90.0 - same->second : same->second,
                       depression ? 90.0 - angle : angle);
    }
    return !fresh;
  });
  if (n_dropped == 0) return;
  warnings.push_back(option + ": " + example + "; it is taken once" +
                     (n_dropped == 1   ? ""
                      : n_dropped == 2 ? ", and so is 1 other"
                                       : ", and so are " + counted(n_dropped - 1, "other")));
}

template <class Value, class Parse>
std::optional<Value> unless_auto(const std::string& text, Parse parse) {
  if (text == "auto") return std::nullopt;
  return parse(text);
}

int count_or_auto(const char* option, const std::string& text) {
  constexpr std::int64_t kMost = 100'000'000;
  return text == "auto" ? 0 : static_cast<int>(parse_whole(option, text, 1, kMost));
}

double resolve_looks(const std::string& text) {
  return text == "inf" ? std::numeric_limits<double>::infinity() : parse_number("--looks", text);
}

ImageFormation resolve_formation(const Texts& t, const std::pair<double, double>& spacing_m) {
  ImageFormation f;
  if (!t.resolution.empty()) f.resolution_m = parse_spacing_m("--resolution", t.resolution);
  f.window = window_from_text(t.window);
  f.looks = resolve_looks(t.looks);
  if (t.nesz != "none") f.nesz_db = parse_number("--nesz", t.nesz);
  f.seed = static_cast<std::uint64_t>(
      parse_whole("--seed", t.seed, 0, std::numeric_limits<std::int64_t>::max()));
  validate(f, spacing_m.first, spacing_m.second);
  return f;
}

Options resolve(const Texts& t, const CommandLine& command, bool altitude_given) {
  Options o;
  o.shared = command.shared_options();
  o.given = command.given();
  o.scene = t.scene;
  o.incidence_deg = resolve_incidence_deg(t);
  o.azimuth_deg = parse_angles_deg("--azimuth", t.azimuth);
  drop_repeated(t.depression.empty() ? "--pitch" : "--depression", o.incidence_deg, o.warnings);
  drop_repeated("--azimuth", o.azimuth_deg, o.warnings);
  for (const auto& [option, text] : {std::pair("--pitch", &t.pitch), std::pair("--depression", &t.depression),
                                     std::pair("--azimuth", &t.azimuth)}) {
    const std::string note = text->empty() ? std::string() : unmet_end(option, *text);
    if (!note.empty()) o.notes.push_back(note);
  }
  if (double(o.incidence_deg.size()) * double(o.azimuth_deg.size()) > 1e6) {
    throw UsageError("--pitch times --azimuth make more than a million views; widen their steps");
  }
  if (!t.slant_range.empty() && altitude_given) {
    throw UsageError("--altitude and --slant-range both place the radar; give one of them");
  }
  o.altitude_m = parse_between("--altitude", t.altitude, kNearestRadar_m, kFarthestRadar_m);
  if (!t.slant_range.empty()) o.slant_range_m = parse_between("--slant-range", t.slant_range, kNearestRadar_m, kFarthestRadar_m);
  o.look = t.look == "left" ? Look::left : Look::right;
  o.aim_m = unless_auto<glm::dvec3>(t.aim, [](const auto& s) { return parse_vector("--aim", s); });

  o.size = unless_auto<std::pair<int, int>>(
      t.size, [](const auto& s) { return parse_image_size("--size", s); });
  o.spacing_m = parse_spacing_m("--spacing", t.spacing);
  o.calibration = calibration_from_name(t.calibration);
  o.quantity = quantity_from_name(t.quantity);
  o.formation = resolve_formation(t, o.spacing_m);

  o.units_m = parse_units_m("--units", t.units);
  o.scale = parse_positive("--scale", t.scale);
  o.up = t.up == "z" ? UpAxis::z : UpAxis::y;
  o.materials = t.materials;
  if (!t.ground.empty()) o.ground = t.ground;
  o.ground_height_m = unless_auto<double>(
      t.ground_height, [](const auto& s) { return parse_number("--ground-height", s); });

  o.engine = t.engine == "surface" ? EngineChoice::surface
             : t.engine == "voxel" ? EngineChoice::voxel
                                   : EngineChoice::automatic;
  o.voxel_size_m = unless_auto<double>(
      t.voxel_size, [](const auto& s) { return parse_positive("--voxel-size", s); });
  o.extinction_per_density = parse_positive("--extinction-per-density", t.extinction_per_density);
  o.save_volume = t.save_volume;
  if (o.volume() && o.engine == EngineChoice::surface) {
    throw UsageError("--engine surface needs a mesh, and " + o.scene.string() +
                     " is a volume; leave the option out");
  }
  if (o.volume() && o.voxel_size_m) {
    throw UsageError("--voxel-size is for meshes, and " + o.scene.string() +
                     " has voxels already; leave the option out");
  }
  if (!o.save_volume.empty() && o.save_volume.extension() != ".vdb") {
    throw UsageError("--save-volume: expected a name ending in .vdb, found " + o.save_volume.string());
  }
  if (o.engine == EngineChoice::surface && (o.voxel_size_m || !o.save_volume.empty())) {
    throw UsageError("--engine surface makes no voxels: leave out --voxel-size and --save-volume, or "
                     "choose --engine voxel");
  }

  o.sampling.n_elevation = count_or_auto("--elevations", t.elevations);
  o.sampling.n_sub_rows = count_or_auto("--sub-rows", t.sub_rows);
  o.sampling.integrator = integrator_from_name(t.integrator);

  if (!t.error.empty()) {
    o.tolerance = parse_part("--error", t.error, kLeastTolerance, kMostTolerance);
    if (o.sampling.n_elevation > 0 || o.sampling.n_sub_rows > 0) {
      throw UsageError("--error chooses --elevations and --sub-rows itself; leave them out");
    }
    if (!o.volume() && (o.engine == EngineChoice::voxel || o.voxel_size_m || !o.save_volume.empty())) {
      throw UsageError("--error chooses rays and slices, but voxels made from a mesh have an error of their own; leave out "
                       "--engine voxel, --voxel-size and --save-volume: the surface engine meets any tolerance sooner");
    }
  }
  o.layers = layers_from_text(t.layers);
  o.output = t.output;
  o.overwrite = t.overwrite;
  o.explain = t.explain || t.dry_run;
  o.dry_run = t.dry_run;
  return o;
}

}  // namespace

std::string_view name(EngineChoice choice) {
  return choice == EngineChoice::surface ? "surface" : choice == EngineChoice::voxel ? "voxel" : "auto";
}

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_render", kDescription);
  Texts texts;
  add_options(command, texts);
  if (!command.parse(argc, argv)) return std::nullopt;
  const bool altitude_given = command.parser().get_option("--altitude")->count() > 0;
  return resolve(texts, command, altitude_given);
}

namespace {

std::string default_name(const Options& options) {
  return options.scene.stem().string() + "_sar";
}

std::filesystem::path base_of(const Options& options) {
  return image_base(options.output, default_name(options));
}

}  // namespace

ImagePaths image_paths(const Options& options) {
  const std::filesystem::path base = base_of(options);
  return {with_ending(base, ".tif"), with_ending(base, ".png"), with_ending(base, ".report.json"),
          with_ending(base, ".json")};
}

std::filesystem::path ImagePaths::layer(const std::string& ending) const {
  return with_ending(tiff.parent_path() / tiff.stem(), ending);
}

std::filesystem::path sweep_folder(const Options& options) {
  const std::filesystem::path folder = options.output.empty() ? default_name(options) : options.output;
  return folder.has_filename() ? folder : folder.parent_path();
}

std::string output_text(const Options& options) {
  if (options.sweep()) return sweep_folder(options).string() + "/";
  const std::string base = base_of(options).string();
  return base + ".tif, " + base + ".png, " + base + ".json";
}

void require_volume_place(const Options& options) {
  const std::filesystem::path& place = options.save_volume;
  if (place.empty()) return;
  refuse_input(place, options);
  std::error_code ignored;
  if (!options.overwrite && std::filesystem::exists(place, ignored)) {
    throw UsageError("--save-volume: " + place.string() +
                     " exists; choose another name or allow --overwrite");
  }
  require_possible(place.has_parent_path() ? place.parent_path() : std::filesystem::path("."));
}

void refuse_input(const std::filesystem::path& output, const Options& options) {
  std::vector<std::filesystem::path> inputs{options.scene, options.materials, options.shared.config_file};
  inputs.insert(inputs.end(), options.indirect_inputs.begin(), options.indirect_inputs.end());
  refuse_input(output, inputs);
}

}  // namespace sarnerf::app
