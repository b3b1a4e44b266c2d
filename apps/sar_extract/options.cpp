// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <cctype>

#include "command_line.h"
#include "output_lock.h"
#include "torch_setup.h"
#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/error.h"
#include "values.h"

namespace sarnerf::app {
namespace {

constexpr const char* kDescription =
    "Takes what sar_nerf_train has learned out of its model: an OpenVDB volume that sar_render renders, the body's\n"
    "surface as a mesh, a picture of it, and a score against a true mesh. Writes OUT.vdb, OUT.json (how it was made)\n"
    "and OUT.report.json (times, scores).";

constexpr const char* kExamples =
    "Examples:\n"
    "  sar_extract cuboid_run cuboid.vdb --mesh cuboid.ply --preview cuboid.png\n"
    "  sar_extract cuboid_run cuboid.vdb --ground-height 0 --truth cuboid.obj\n"
    "  sar_extract cuboid_run native.vdb --resolution native\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 not finite, 130 interrupted.";

constexpr int kMostVoxels = 8192;

struct Texts {
  std::string model, output, resolution = "256", extent = "20", centre = "auto", threshold = "auto";
  std::string ground_height = "auto", mesh, preview, truth, units = "m", scale = "1", up = "y", images = "auto";
  bool solid = false, shell = false, overwrite = false, explain = false, dry_run = false;
};

void add_options(CommandLine& command, Texts& t) {
  CLI::App& p = command.parser();
  const auto add = [&](const char* name, std::string& text, const char* type, const char* help) {
    return command.add_text_option(name, text, type, help);
  };
  p.add_option("MODEL", t.model, "model.pt, or the folder of a run")->type_name("FILE")->required();
  p.add_option("OUT", t.output, "Volume to write; default: the run's name with .vdb")->type_name("FILE");

  command.begin_group("Volume");
  add("--resolution", t.resolution, "N|native",
      "Voxels along a side of the extent; native: the learned lattice, all of it");
  add("--extent", t.extent, "M", "Side of the cube that is extracted");
  add("--centre", t.centre, "X,Y,Z|auto", "Of the cube (m); auto: over the aim point, where matter is, near its bottom if it is higher");

  command.begin_group("Body (occupancy, mesh and scores; extinction and brightness stay as they were learned)");
  command.add_flag("--solid", t.solid, "Surfaces that the training views see, and all behind them (default)");
  command.add_flag("--shell", t.shell, "Matter denser than the threshold, where it is");
  add("--threshold", t.threshold, "X|auto",
      "One-way extinction (1/m) of matter; auto: Otsu's for --shell, all matter for --solid");
  add("--ground-height", t.ground_height, "M|auto", "Where the body ends below; auto: at the model's level ground, else where returns end");

  command.begin_group("Output");
  add("--mesh", t.mesh, "FILE", "Surface as .ply or .obj");
  add("--preview", t.preview, "FILE", "Picture of it (.png)");
  command.add_flag("--overwrite", t.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", t.explain, "Print the plan before the work, and the volume's grids after it");
  command.add_flag("--dry-run", t.dry_run, "Print the plan and stop; writes nothing");

  command.begin_group("Score");
  add("--truth", t.truth, "SCENE", "Mesh or scene to compare with: OBJ, PLY, STL, OFF, .json");
  add("--truth-units", t.units, "UNIT", "Of the truth: m, cm, mm, km, ft, in, or metres as a number");
  add("--truth-scale", t.scale, "FACTOR", "Extra factor on the truth's coordinates");
  add("--truth-up", t.up, "y|z", "Axis that points up in the truth")->check(one_of({"y", "z"}));
  add("--images", t.images, "FOLDER|auto|none",
      "Training images, for the carving baseline; auto: where the model says");

  command.add_shared_options();
  p.footer(kExamples);
}

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

void require_ending(const char* what, const std::filesystem::path& path, const std::string& ending) {
  if (lower_ending(path) != ending)
    throw UsageError(std::string(what) + ": expected a file that ends in " + ending + ", found " + path.string());
}

ExtractOptions extract_options(const Texts& t) {
  ExtractOptions e;
  e.resolution = t.resolution == "native"
                     ? 0
                     : static_cast<int>(parse_whole("--resolution", t.resolution, 2, kMostVoxels));
  e.extent_m = parse_positive("--extent", t.extent);
  if (t.centre != "auto") e.centre_m = parse_vector("--centre", t.centre);
  if (t.solid && t.shell) throw UsageError("--solid and --shell are different bodies; give one of them");
  e.body = t.shell ? Body::shell : Body::solid;
  if (t.threshold != "auto") e.threshold_per_m = parse_positive("--threshold", t.threshold);
  if (t.ground_height != "auto") e.ground_height_m = parse_number("--ground-height", t.ground_height);
  return e;
}

Options resolve(const Texts& t, const CommandLine& command) {
  Options o;
  o.shared = command.shared_options();
  o.model = without_slash(t.model);
  o.extract = extract_options(t);
  if (o.extract.resolution == 0) {
    auto& parser = const_cast<CommandLine&>(command).parser();
    for (const char* name : {"--extent", "--centre"})
      if (parser.get_option(name)->count() > 0)
        throw UsageError(std::string("--resolution native takes all that was learned; leave out ") + name);
  }
  o.output = t.output.empty() ? model_name(o.model) + ".vdb" : t.output;
  require_ending("OUT", o.output, ".vdb");
  o.mesh = t.mesh;
  if (!o.mesh.empty()) require_mesh_ending(o.mesh);
  o.preview = t.preview;
  if (!o.preview.empty()) require_ending("--preview", o.preview, ".png");
  o.truth = t.truth;
  if (!o.truth.empty()) {
    require_scene_file(o.truth);
    if (lower_ending(o.truth) == ".vdb") throw UsageError("--truth: expected a mesh or a scene of meshes, found a volume");
  }
  o.truth_options.units_m = parse_units_m("--truth-units", t.units);
  o.truth_options.scale = parse_positive("--truth-scale", t.scale);
  o.truth_options.up = t.up == "z" ? UpAxis::z : UpAxis::y;
  o.images = dataset_folder(t.images).string();
  o.overwrite = t.overwrite;
  o.explain = t.explain;
  o.dry_run = t.dry_run;
  return o;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_extract", kDescription);
  Texts texts;
  add_options(command, texts);
  if (!command.parse(argc, argv)) return std::nullopt;
  return resolve(texts, command);
}

}  // namespace sarnerf::app
