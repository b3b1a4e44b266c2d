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

/// Limits of --error. Below the lower one, the errors of single precision and of the deposit's own tolerance become visible.
constexpr double kLeastTolerance = 0.001, kMostTolerance = 0.2;

/// Most rays or slices of a row: more is a mistake, and an int can hold this number.
constexpr std::int64_t kMostRays = 100'000'000;

void require_views(const CommandLine& command) {
  if (!command.given("--pitch") && !command.given("--depression")) {
    throw UsageError("--pitch (from the vertical) or --depression (from the horizontal) is needed, such "
                     "as --pitch 45");
  }
}

/// Drops directions that are given twice, as by 0:360:10: they would make the same image twice, and a split might put
/// one on each side.
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

void resolve_views(const CommandLine& command, Options& o) {
  drop_repeated(command.given("--depression") ? "--depression" : "--pitch", o.incidence_deg, o.warnings);
  drop_repeated("--azimuth", o.azimuth_deg, o.warnings);
  for (const char* option : {"--pitch", "--depression", "--azimuth"}) {
    const std::string note = command.given(option) ? unmet_end(option, command.text(option)) : "";
    if (!note.empty()) o.notes.push_back(note);
  }
  if (double(o.incidence_deg.size()) * double(o.azimuth_deg.size()) > 1e6) {
    throw UsageError("--pitch times --azimuth make more than a million views; widen their steps");
  }
}

void refuse_wrong_engine(const Options& o) {
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
}

void refuse_useless_tolerance(const Options& o) {
  if (!o.tolerance) return;
  if (o.sampling.n_elevation > 0 || o.sampling.n_slices > 0) {
    throw UsageError("--error chooses --elevations and --sub-rows itself; leave them out");
  }
  if (!o.volume() && (o.engine == EngineChoice::voxel || o.voxel_size_m || !o.save_volume.empty())) {
    throw UsageError("--error chooses rays and slices, but voxels made from a mesh have an error of their own; leave out "
                     "--engine voxel, --voxel-size and --save-volume: the surface engine meets any tolerance sooner");
  }
}

void add_options(CommandLine& command, Options& o) {
  command.then([&] {
    o.shared = command.shared_options();
    o.given = command.given();
    require_views(command);
  });
  command.add("SCENE", o.scene, path("FILE"), "Mesh (.obj, .ply, .stl, .off), scene (.json) or volume (.vdb)");
  command.require("SCENE");

  command.begin_group("Views (angles: 45, a list 15,17 or a range 0:350:10 with its end, if a step meets it)");
  command.add("--pitch", o.incidence_deg, incidences_deg(command), "Incidence at the aim point, from the vertical; 0 < DEG < 90");
  command.add("--depression", o.incidence_deg, incidences_deg(command), "The same from the horizontal: 90 - pitch");
  command.add("--azimuth", o.azimuth_deg, angles_deg(), "Where the radar stands");
  command.then([&] { resolve_views(command, o); });
  command.add("--altitude", o.altitude_m, radar_distance_m(command), "Radar above the aim point");
  command.add("--slant-range", o.slant_range_m, radar_distance_m(command), "Radar to aim point, instead of --altitude");
  command.add("--look", o.look, one_of<Look>({{"right", Look::right}, {"left", Look::left}}), "Side to which the radar looks");
  command.add("--aim", o.aim_m, point_m().or_word("auto"), "Aim point (m); auto: horizontal centre at the lowest height");

  command.begin_group("Image");
  command.add("--size", o.size, image_size().or_word("auto"), "Pixels, azimuth x range (64: 64x64); auto: scene, layover, shadow");
  command.add("--spacing", o.spacing_m, spacing_m(), "Pixel spacing (m), azimuth and slant range");
  command.add("--calibration", o.calibration,
              one_of<Calibration>({{"beta0", Calibration::beta0}, {"sigma0", Calibration::sigma0},
                                   {"gamma0", Calibration::gamma0}}, "NAME"),
              "beta0, sigma0 or gamma0");
  command.add("--quantity", o.quantity,
              one_of<Quantity>({{"power", Quantity::power}, {"amplitude", Quantity::amplitude}}, "NAME"),
              "power, or amplitude: its root");

  command.begin_group("Image formation (off by default: images are mean incoherent power)");
  command.add("--resolution", o.formation.resolution_m, spacing_m(), "-3 dB widths (m) of the impulse response, coarser than --spacing");
  command.add("--window", o.formation.window, made_by("NAME", window_from_text, "none"),
              "none, hann, hamming, taylor:DB[,NBAR] as taylor:-35, kaiser:BETA");
  command.add("--looks", o.formation.looks, number("L").or_word("inf", std::numeric_limits<double>::infinity()),
              "Gamma speckle of L >= 1 looks of the full resolution; inf: none");
  command.add("--nesz", o.formation.nesz_db, number("DB").or_word("none"), "Noise floor: noise-equivalent sigma0");
  command.add("--seed", o.formation.seed, whole("N", 0, std::numeric_limits<std::int64_t>::max()), "Of speckle and noise");
  command.then([&] { validate(o.formation, o.spacing_m.first, o.spacing_m.second); });

  command.begin_group("Scene (units, scale and up of a mesh file; a scene file says them for each of its meshes)");
  command.add("--units", o.units_m, units_m(), "Of the file: m, cm, mm, km, ft, in, or metres as a number");
  command.add("--scale", o.scale, positive("FACTOR"), "Extra factor on the file's coordinates");
  command.add("--up", o.up, one_of<UpAxis>({{"y", UpAxis::y}, {"z", UpAxis::z}}), "Axis that points up in the file");
  command.add("--materials", o.materials, path("FILE"), "Materials (.json) on top of the built-in ones");
  command.add("--ground", o.ground, text("MATERIAL|none"), "Ground plane; default: what a scene file says, else none");
  command.add("--ground-height", o.ground_height_m, between("M", -kFarthestRadar_m, kFarthestRadar_m).or_word("auto"), "Reference plane and ground; auto: lowest height");

  command.begin_group("Computation");
  command.add("--engine", o.engine,
              one_of<EngineChoice>({{"auto", EngineChoice::automatic}, {"surface", EngineChoice::surface},
                                    {"voxel", EngineChoice::voxel}}),
              "surface: rays against the mesh; voxel: rays through sparse voxels; auto: says which and why");
  command.add("--voxel-size", o.voxel_size_m, positive("M").or_word("auto"),
              "Voxels made from a mesh; auto: half the finer spacing");
  command.add("--extinction-per-density", o.extinction_per_density, positive("1/M"),
              "Of fog volumes (.vdb) made by other tools");
  command.add("--save-volume", o.save_volume, path("FILE"), "Write the voxels to FILE (.vdb)");
  command.then([&] { refuse_wrong_engine(o); });
  command.add("--error", o.tolerance, part("E", kLeastTolerance, kMostTolerance),
              "Sample just as finely as this needs: 1% or 0.01 of the image's norm, by its own estimate");
  command.add("--elevations", o.sampling.n_elevation, whole("N", 1, kMostRays).or_word("auto", 0),
              "Elevation rays; auto: from the spacing");
  command.add("--sub-rows", o.sampling.n_slices, whole("N", 1, kMostRays).or_word("auto", 0), "Slices per azimuth row");
  command.add("--integrator", o.sampling.integrator, made_by("NAME", integrator_from_name, "exact"),
              "Of translucent matter and voxels: exact; midpoint and paper (an older, darker sum) to compare "
              "with; paper-gated: what the paper of SAR-NeRF trains");
  command.read_later({"--error"});
  command.then([&] { refuse_useless_tolerance(o); });

  command.begin_group("Output");
  command.add("--layers", o.layers, made_by("LIST|all|none", layers_from_text, "none"),
              "Beside the image: ground, wall, roof, other, mask, incidence, elevation, scatterers, error");
  command.add("-o,--output", o.output, text("NAME"), "File name without ending, or folder; default SCENE_sar");
  command.add_flag("--overwrite", o.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", o.explain, "Print the plan before the work: rays, bytes, seconds, what is left out");
  command.add_flag("--dry-run", o.dry_run, "Print the plan and stop");
  command.then([&] { o.explain = o.explain || o.dry_run; });

  command.same_meaning({"pitch", "depression"});
  command.same_meaning({"altitude", "slant-range"});
  command.add_shared_options();
}

}  // namespace

std::string_view name(EngineChoice choice) {
  return choice == EngineChoice::surface ? "surface" : choice == EngineChoice::voxel ? "voxel" : "auto";
}

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_render", kDescription, kExamples);
  Options options;
  add_options(command, options);
  if (!command.parse(argc, argv)) return std::nullopt;
  return options;
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

void require_volume_place(const Options& options, bool continues) {
  const std::filesystem::path& place = options.save_volume;
  if (place.empty()) return;
  refuse_input(place, options);
  std::error_code ignored;
  if (!continues && !options.overwrite && std::filesystem::exists(place, ignored))
    throw UsageError("--save-volume: " + place.string() + " exists; choose another name or allow --overwrite");
  require_possible(place.has_parent_path() ? place.parent_path() : std::filesystem::path("."));
}

void refuse_input(const std::filesystem::path& output, const Options& options) {
  std::vector<std::filesystem::path> inputs{options.scene, options.materials, options.shared.config_file};
  inputs.insert(inputs.end(), options.indirect_inputs.begin(), options.indirect_inputs.end());
  refuse_input(output, inputs);
}

}  // namespace sarnerf::app
