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
    "  sar_extract cuboid/ --score other_program.ply --truth cuboid.obj\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 4 not finite, 130 interrupted.";

constexpr int kMostVoxels = 8192;

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

Kind<std::filesystem::path> file_of(const std::string& ending) {
  return path("FILE").checked([ending](const std::string& option, const std::string& text) {
    if (lower_ending(text) != ending)
      throw UsageError(option + ": expected a file that ends in " + ending + ", found " + text);
  });
}

Kind<std::filesystem::path> truth_file() {
  return path("SCENE").checked([](const std::string& option, const std::string& text) {
    require_scene_file(text);
    if (lower_ending(text) == ".vdb") throw UsageError(option + ": expected a mesh or a scene of meshes, found a volume");
  });
}

void refuse_extent_of_native(const CommandLine& command) {
  for (const char* name : {"--extent", "--centre"})
    if (command.given(name))
      throw UsageError(std::string("--resolution native takes all that was learned; leave out ") + name);
}

void add_options(CommandLine& command, Options& o) {
  command.then([&] { o.shared = command.shared_options(); });
  command.add("MODEL", o.model, made_by("FILE", without_slash), "model.pt, or the folder of a run");
  command.require("MODEL");
  command.add("OUT", o.output, file_of(".vdb"), "Volume to write; default: the run's name with .vdb");

  command.begin_group("Volume");
  command.add("--resolution", o.extract.resolution, whole("N", 2, kMostVoxels).or_word("native", 0),
              "Voxels along a side of the extent; native: the learned lattice, all of it");
  command.add("--extent", o.extract.extent_m, positive("M"), "Side of the cube that is extracted");
  command.add("--centre", o.extract.centre_m, point_m().or_word("auto"),
              "Of the cube (m); auto: over the aim point, where matter is, near its bottom if it is higher");

  command.begin_group("Body (occupancy, mesh and scores; extinction and brightness stay as they were learned)");
  command.add("--threshold", o.extract.threshold_per_m, positive("X").or_word("auto"),
              "Of the fields grid, mlp and paper: one-way extinction (1/m) of matter; auto: Otsu's");
  command.add("--unseen", o.extract.unseen, one_of<std::optional<Unseen>>({{"auto", std::nullopt}, {"membrane", Unseen::membrane}, {"hull", Unseen::hull}}),
              "Of the field surface, where no view sees it: a membrane between seen parts, or the hull, all that views allow; auto: "
              "the hull where a ground is known, which bounds it, else the membrane");
  command.refuse_replaced("--solid", "the fields grid and mlp are fog and have no inside; learn the images with sar_nerf_train --field "
                                     "surface, whose body is solid without it");
  command.refuse_replaced("--shell", "matter above --threshold is what the fields grid and mlp give without it; leave it out");
  command.add("--ground-height", o.extract.ground_height_m, number("M").or_word("auto"),
              "Where the body ends below; auto: at the model's level ground, if it has one");
  command.then([&] {
    if (o.extract.resolution == 0) refuse_extent_of_native(command);
  });
  command.read_later({"OUT"});

  command.begin_group("Output");
  command.add("--mesh", o.mesh, path("FILE").checked([](auto&, auto& text) { require_mesh_ending(text); }), "Surface as .ply or .obj");
  command.add("--preview", o.preview, file_of(".png"), "Picture of it (.png)");
  command.add_flag("--overwrite", o.overwrite, "Replace output of a different recipe, or repeat the same");
  command.add_flag("--explain", o.explain, "Print the plan before the work, and the volume's grids after it");
  command.add_flag("--dry-run", o.dry_run, "Print the plan and stop; writes nothing");

  command.begin_group("Score");
  command.add("--truth", o.truth, truth_file(), "Mesh or scene to compare with: OBJ, PLY, STL, OFF, .json");
  command.add("--score", o.score, path("MESH"),
              "Score this mesh instead of extracting one: with --truth, and views from MODEL, which may be a dataset folder");
  command.add("--truth-units", o.truth_options.units_m, units_m(),
              "Of the truth: m, cm, mm, km, ft, in, or metres as a number");
  command.add("--truth-scale", o.truth_options.scale, positive("FACTOR"), "Extra factor on the truth's coordinates");
  command.add("--truth-up", o.truth_options.up, one_of<UpAxis>({{"y", UpAxis::y}, {"z", UpAxis::z}}),
              "Axis that points up in the truth");
  command.add("--images", o.images, made_by("FOLDER|auto|none", dataset_folder, "auto"),
              "Training images, for the carving baseline; auto: where the model says");

  command.then([&] {
    if (o.score.empty()) return;
    if (o.truth.empty()) throw UsageError("--score: expected --truth, the mesh to compare with; give it, too");
    require_scene_file(o.score);
    for (const char* name : {"--mesh", "OUT", "--threshold", "--unseen"})
      if (command.given(name)) throw UsageError(std::string("--score extracts nothing: leave out ") + name);
    if (o.extract.resolution == 0) throw UsageError("--score extracts nothing: --resolution is that of carving, and needs a number");
    if (o.images != "auto" && o.images != "none" && std::filesystem::exists(o.model / "dataset.json"))
      throw UsageError("--images: MODEL is a dataset, whose images carving takes; leave out --images, or say none");
  });

  command.add_shared_options();
  command.then([&] {
    if (o.output.empty()) o.output = model_name(o.model) + ".vdb";
  });
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  CommandLine command("sar_extract", kDescription, kExamples);
  Options options;
  add_options(command, options);
  if (!command.parse(argc, argv)) return std::nullopt;
  return options;
}

}  // namespace sarnerf::app
