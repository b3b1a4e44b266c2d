// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include "version.h"
#include <nlohmann/json.hpp>

#include "app_main.h"
#include "job.h"
#include "output_files.h"
#include "output_lock.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/model_file.h"
#include "torch_setup.h"
#include "values.h"

namespace sarnerf::app {

namespace {

constexpr const char* kProgram = "sar_extract";

struct Paths {
  std::filesystem::path volume, recipe, report;
};

Paths paths_of(const Options& o) {
  std::filesystem::path base = o.output;
  base.replace_extension();
  return {o.output, with_ending(base, ".json"), with_ending(base, ".report.json")};
}

bool is_scene_file(const std::filesystem::path& truth) { return truth.extension() == ".json"; }

/// `truth`: that of a scene file, of which the meshes that it names decide, too.
Json request_of(const Options& o, const std::string& model_sha256, const std::optional<Truth>& truth) {
  const ExtractOptions& e = o.extract;
  Json j;
  j["model"] = {{"file", model_file(o.model).filename().string()}, {"sha256", model_sha256}};
  j["volume"] = e.resolution == 0 ? Json{{"resolution", "native"}}
                                  : Json{{"resolution", e.resolution}, {"extent_m", e.extent_m}};
  if (e.centre_m) j["volume"]["centre_m"] = {e.centre_m->x, e.centre_m->y, e.centre_m->z};
  j["body"] = {{"unseen", !e.unseen ? "auto" : *e.unseen == Unseen::membrane ? "membrane" : "hull"}};
  if (e.threshold_per_m) j["body"]["threshold_per_m"] = *e.threshold_per_m;
  if (e.ground_height_m) j["body"]["ground_height_m"] = *e.ground_height_m;
  if (!o.mesh.empty()) j["mesh"] = o.mesh.filename().string();
  if (!o.preview.empty()) j["preview"] = o.preview.filename().string();
  if (!o.truth.empty())
    j["truth"] = {{"file", o.truth.filename().string()},
                  {"sha256", sha256_of_file(o.truth)},
                  {"units_m", o.truth_options.units_m},
                  {"scale", o.truth_options.scale},
                  {"up", o.truth_options.up == UpAxis::z ? "z" : "y"},
                  {"images", o.images}};
  if (truth) {
    j["truth"]["files"] = Json::array();
    for (const auto& path : truth->files)
      if (path != o.truth) j["truth"]["files"].push_back({{"file", path.filename().string()}, {"sha256", sha256_of_file(path)}});
  }
  return valid_text(j);
}

/// The text that the same recipe printed before, if its output is complete. Throws UsageError for output of another recipe.
std::optional<Printed> finished(const Options& o, const Paths& paths, const Json& request) {
  const auto refuse = [&](const std::string& why) {
    throw UsageError(paths.volume.string() + ": other output is in the way (" + why +
                     "); choose another name or allow --overwrite");
  };
  const auto recipe = read_recipe(paths.recipe);
  if (!recipe) {
    for (const auto& path : {paths.volume, paths.recipe, o.mesh, o.preview})
      if (!path.empty() && std::filesystem::exists(path)) refuse(path.filename().string() + " without a recipe");
    return std::nullopt;
  }
  const std::string differs = difference(recipe->value("request", Json()), request);
  if (!differs.empty()) refuse(differs);
  for (const auto& path : {paths.volume, paths.report, o.mesh, o.preview})
    if (!path.empty() && !std::filesystem::exists(path)) return std::nullopt;
  std::ifstream file(paths.report);
  const Json report = Json::parse(file, nullptr, false);
  return report.is_object() ? Printed::from(report.value("printed", Json())) : std::nullopt;
}

void require_places(const Options& o, const Paths& paths) {
  const std::vector<std::filesystem::path> inputs{model_file(o.model), o.truth, o.shared.config_file};
  for (const auto& path : {paths.volume, paths.recipe, paths.report, o.mesh, o.preview}) {
    if (path.empty()) continue;
    refuse_input(path, inputs);
    if (std::filesystem::is_directory(path))
      throw UsageError(path.string() + ": expected a place for a file, found a folder; choose another name");
    const auto folder = path.parent_path();
    require_possible(folder.empty() ? "." : folder);
  }
}

/// The files that will be written.
std::vector<std::filesystem::path> outputs_of(const Options& o, const Paths& paths) {
  std::vector<std::filesystem::path> outputs{paths.volume, paths.recipe, paths.report};
  for (const auto& path : {o.mesh, o.preview})
    if (!path.empty()) outputs.push_back(path);
  return outputs;
}

/// The likeliest reason why the body is empty.
std::string empty_body_text(const Options& o, const Extraction& x) {
  const std::string what = "the body is empty: ";
  if (x.part_outside > 0.5)
    return what + format("the cube leaves out %.0f %% of the box of what was learned; raise --extent, or move --centre",
                         100.0 * x.part_outside);
  const glm::dvec3 size_m = x.volume.scene_box_m.empty() ? glm::dvec3(0.0) : x.volume.scene_box_m.size();
  if (o.extract.resolution != 0 && std::max({size_m.x, size_m.y, size_m.z}) < 8.0 * x.voxel_size_m)
    return what + format("voxels of %.3g m are coarse for what was learned, %.3g x %.3g x %.3g m; lower --extent, or raise "
                         "--resolution",
                         x.voxel_size_m, size_m.x, size_m.y, size_m.z);
  if (o.extract.threshold_per_m)
    return what + format("little is as dense as --threshold %.3g per metre; lower it", *o.extract.threshold_per_m);
  if (o.extract.ground_height_m)
    return what + format("no matter was learned above --ground-height %.4g m; lower it, or train longer", *o.extract.ground_height_m);
  return what + "no matter was learned; train longer";
}

void tell(const Options& o, const Model& model, const Extraction& x, Console& console) {
  if (x.mesh.triangles.empty()) console.warning(empty_body_text(o, x));
  if (x.part_outside > 0.01)
    console.warning(format("--extent cuts off %.1f %% of the box of what was learned", 100.0 * x.part_outside));
  if (model.field->kind() != "surface")
    console.note("the field " + std::string(model.field->kind()) +
                 " is fog: this is where it is dense, hollow where no view sees into it; sar_nerf_train --field surface learns a body");
  if (is_network(model.field->kind()))
    console.note(format("harmonics of degree 2 keep the network's brightness to within %.1f %%", 100.0 * x.harmonics_residual));
  if (const Integrator integrator = model.field->integrator(); integrator != Integrator::exact)
    console.note("learned by the rule " + std::string(name(integrator)) +
                 ", which depends on the range bins: of the volume, sar_render --integrator " +
                 std::string(name(integrator)) + " comes nearest");
}

Json report_json(const Options& o, const Extraction& x, const std::optional<Scores>& scores, double write_s,
                 const Printed& printed) {
  Json j{{"format", "sarnerf-report"},
         {"version", 1},
         {"program", std::string(kProgram) + " " + std::string(kVersion)},
         {"threads", o.shared.n_threads},
         {"voxel_size_m", x.voxel_size_m},
         {"triangles", x.mesh.triangles.size()},
         {"bottom_m", x.bottom_m},
         {"threshold_per_m", x.threshold_per_m},
         {"harmonics_residual", x.harmonics_residual},
         {"components", x.n_components},
         {"unseen_components", x.n_unseen_components},
         {"largest_component_m", {x.largest_component_m.x, x.largest_component_m.y, x.largest_component_m.z}},
         {"unseen_part", x.unseen_part},
         {"seconds",
          {{"field", x.seconds.field},
           {"body", x.seconds.body},
           {"mesh", x.seconds.mesh},
           {"write", write_s},
           {"score", scores ? scores->seconds : 0.0},
           {"total", seconds_since_start()}}},
         {"machine", {{"processor", processor_name()}, {"libraries", torch_text()}}},
         {"memory_bytes", {{"peak", peak_memory_bytes()}}},
         {"printed", printed.json()}};
  if (scores) j["scores"] = scores_json(*scores);
  return valid_text(j);
}

}  // namespace

std::string extract_and_write(const Options& o, Console& console, const Monitor& monitor) {
  const Paths paths = paths_of(o);
  require_places(o, paths);
  const std::string sha256 = sha256_of_file(model_file(o.model));
  if (o.dry_run) return plan_text(o, read_model(model_file(o.model))) + "\n";
  std::optional<Truth> truth;
  if (is_scene_file(o.truth)) truth = load_truth(o, console, monitor);
  const Json request = request_of(o, sha256, truth);
  const std::vector<std::filesystem::path> outputs = outputs_of(o, paths);
  for (const auto& path : outputs)
    if (!path.parent_path().empty()) make_folder(path.parent_path());
  const OutputLock lock(outputs);
  if (!o.overwrite) {
    if (const auto printed = finished(o, paths, request)) {
      console.note("already done: the same recipe is there, nothing was extracted");
      return printed->text(o);
    }
  }
  const Model model = open_model(o.model, console);
  const auto* const mlp = dynamic_cast<const MlpField*>(model.field.get());
  use_torch_threads(mlp ? o.shared.n_threads : 1);
  if (mlp) warn_of_slow_blas(mlp->kernel(), console);
  if (o.explain) console.asked_for(plan_text(o, model));
  // Read before the work, so that a bad file wastes none.
  if (!o.truth.empty() && !truth) truth = load_truth(o, console, monitor);

  ExtractOptions options = o.extract;
  options.model_sha256 = sha256;
  options.monitor = monitor;
  if (const MemoryLimit limit = memory_limit(o.shared); limit.bytes > 0) {
    if (limit.bytes <= kBaseMemory_bytes)
      throw UsageError("about " + bytes_text(kBaseMemory_bytes) + " are needed before any voxel, and " + limit.text());
    options.max_memory_bytes = limit.bytes - kBaseMemory_bytes;
  }
  Extraction extraction = extract(model, options);
  tell(o, model, extraction, console);
  std::optional<Scores> scores;
  if (truth)
    scores = score_mesh(*truth, extraction.mesh, witnesses_of(o, model.info, console, monitor),
                        {extraction.box_m, extraction.voxel_size_m}, extraction.floor_m, console, monitor);
  monitor.check();

  // If the machine stops between the renames, no old recipe must stand beside new files.
  const double before_writing_s = seconds_since_start();
  std::filesystem::remove(paths.recipe);
  extraction.volume.set_metadata("program", std::string(kProgram) + " " + std::string(kVersion));
  write_vdb(extraction.volume, paths.volume);
  if (!o.mesh.empty()) write_mesh(extraction.mesh, o.mesh, std::string(kProgram) + " of a model " + sha256.substr(0, 16));
  AtomicFiles files;
  if (!o.preview.empty()) files.add(o.preview, encode_png(preview(extraction.mesh)));
  const Printed printed = printed_of(o, extraction, scores);
  const double write_s = seconds_since_start() - before_writing_s;
  files.add(paths.report, report_json(o, extraction, scores, write_s, printed).dump(2) + "\n");
  files.add(paths.recipe, recipe_text(make_recipe(kProgram, request, Json::object())));
  files.commit();
  return printed.text(o);
}

namespace {

void run(const Options& options, Console& console) {
  const Monitor monitor{[&](std::string_view stage, std::uint64_t done, std::uint64_t n) {
                          console.progress(stage, done, n);
                        },
                        &stop_requested()};
  print_result(options.score.empty() ? extract_and_write(options, console, monitor) : score_and_write(options, console, monitor));
}

}  // namespace

}  // namespace sarnerf::app

int main(int argc, char** argv) {
  using namespace sarnerf::app;
  return app_main("sar_extract", argc, argv, parse_options, run);
}
