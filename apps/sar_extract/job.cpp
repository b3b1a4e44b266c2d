// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "listing.h"
#include "model_place.h"
#include "output_files.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/bake/preview.h"
#include "sarnerf/bake/write_mesh.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/sha256.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/model_file.h"
#include "scoring.h"
#include "torch_setup.h"
#include "values.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr const char* kProgram = "sar_extract";

/// Of LibTorch and the program, before any grid.
constexpr std::uint64_t kBaseMemory = 600ull << 20;

struct Paths {
  std::filesystem::path volume, recipe, report;
};

Paths paths_of(const Options& o) {
  std::filesystem::path base = o.output;
  base.replace_extension();
  return {o.output, with_ending(base, ".json"), with_ending(base, ".report.json")};
}

Json request_of(const Options& o, const std::string& model_sha256) {
  const ExtractOptions& e = o.extract;
  Json j;
  j["model"] = {{"file", model_file(o.model).filename().string()}, {"sha256", model_sha256}};
  j["volume"] = e.resolution == 0 ? Json{{"resolution", "native"}}
                                  : Json{{"resolution", e.resolution}, {"extent_m", e.extent_m}};
  if (e.centre_m) j["volume"]["centre_m"] = {e.centre_m->x, e.centre_m->y, e.centre_m->z};
  j["body"] = {{"kind", e.body == Body::solid ? "solid" : "shell"}};
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
  return valid_text(j);
}

/// What the same recipe printed before, if its output is all there. Throws UsageError for output of another one.
std::optional<std::string> finished(const Options& o, const Paths& paths, const Json& request) {
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
  if (!report.is_object() || !report.contains("printed") || !report["printed"].is_string()) return std::nullopt;
  return report["printed"].get<std::string>();
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

std::string explained(const Options& o, const Model& model) {
  const ExtractOptions& e = o.extract;
  char volume[120];
  if (e.resolution == 0) {
    std::snprintf(volume, sizeof volume, "the learned lattice, voxels of %.3g m", model.field->voxel_size_m());
  } else {
    std::snprintf(volume, sizeof volume, "%d^3 over %.4g m, voxels of %.3g m", e.resolution, e.extent_m,
                  e.extent_m / e.resolution);
  }
  return "plan\n  model     " + std::string(model.field->kind()) + ", " + model.field->size_text() + ", of " +
         std::to_string(model.info.training_views.size()) + " views\n  volume    " + volume + "\n  body      " +
         (e.body == Body::solid
              ? "solid: what up to " + std::to_string(e.most_views) + " training views see, and all behind it"
              : std::string("shell: matter denser than the threshold")) +
         "\n  left out  voxels without extinction; insides, which are tiles" +
         (o.truth.empty() ? "; scores: no --truth" : "") + (o.mesh.empty() ? "; mesh file: no --mesh" : "") +
         (o.preview.empty() ? "; picture: no --preview" : "");
}

std::string summary_text(const Options& o, const Extraction& x, const std::optional<Scores>& scores) {
  char text[300];
  std::snprintf(text, sizeof text, "surface: %zu triangles; bottom at %.3g m%s; threshold %.3g per metre%s\n",
                x.mesh.triangles.size(), x.bottom_m,
                x.bottom_was_given ? "" : " (where returns end: --ground-height)", x.threshold_per_m,
                o.extract.body == Body::shell || o.extract.threshold_per_m ? "" : " (not used: --solid)");
  std::string result = listing(x) + text;
  if (scores) result += table_text(*scores);
  return result;
}

Json report_json(const Options& o, const Extraction& x, const std::optional<Scores>& scores, double write_s,
                 const std::string& printed) {
  Json j{{"format", "sarnerf-report"},
         {"version", 1},
         {"program", std::string(kProgram) + " " + std::string(kVersion)},
         {"threads", o.shared.n_threads},
         {"voxel_size_m", x.voxel_size_m},
         {"triangles", x.mesh.triangles.size()},
         {"bottom_m", x.bottom_m},
         {"agreeing_share", x.agreeing_share},
         {"threshold_per_m", x.threshold_per_m},
         {"harmonics_residual", x.harmonics_residual},
         {"seconds",
          {{"field", x.seconds.field},
           {"body", x.seconds.body},
           {"mesh", x.seconds.mesh},
           {"write", write_s},
           {"score", scores ? scores->seconds : 0.0},
           {"total", seconds_since_start()}}},
         {"machine", {{"processor", processor_name()}, {"libraries", torch_text()}}},
         {"memory_bytes", {{"peak", peak_memory_bytes()}}},
         {"printed", printed}};
  if (scores) j["scores"] = scores_json(*scores);
  return valid_text(j);
}

}  // namespace

std::string extract_and_write(const Options& o, Console& console, const Monitor& monitor) {
  const Paths paths = paths_of(o);
  require_places(o, paths);
  const std::string sha256 = sha256_of_file(model_file(o.model));
  const Json request = request_of(o, sha256);
  if (!o.overwrite) {
    if (const auto printed = finished(o, paths, request)) {
      console.note("already done: the same recipe is there, nothing was extracted");
      return *printed;
    }
  }
  const Model model = open_model(o.model, console);
  const auto* const mlp = dynamic_cast<const MlpField*>(model.field.get());
  use_torch_threads(mlp ? o.shared.n_threads : 1);
  if (mlp) warn_of_slow_blas(mlp->kernel(), console);
  if (o.explain) console.asked_for(explained(o, model));
  std::optional<Truth> truth;  // before the work: a bad file must not cost it
  if (!o.truth.empty()) truth = load_truth(o, console, monitor);

  ExtractOptions options = o.extract;
  options.model_sha256 = sha256;
  options.monitor = monitor;
  if (const std::uint64_t limit = o.shared.max_memory_bytes; limit > 0) {
    if (limit <= kBaseMemory)
      throw UsageError("about " + bytes_text(kBaseMemory) + " are needed before any voxel, more than --max-memory " +
                       bytes_text(limit));
    options.max_memory_bytes = limit - kBaseMemory;
  }
  Extraction extraction = extract(model, options);
  if (extraction.mesh.triangles.empty())
    console.warning("the body is empty: no training view meets matter; train longer, or try --shell");
  if (extraction.part_outside > 0.0) {
    char text[120];
    std::snprintf(text, sizeof text, "--extent cuts off %.1f %% of the box of what was learned",
                  100.0 * extraction.part_outside);
    if (extraction.part_outside > 0.01) console.warning(text);
  }
  if (mlp) {
    char text[120];
    std::snprintf(text, sizeof text, "harmonics of degree 2 keep the network's brightness to within %.1f %%",
                  100.0 * extraction.harmonics_residual);
    console.note(text);
  }
  std::optional<Scores> scores;
  if (truth) scores = score_extraction(o, *truth, model, extraction, console, monitor);
  monitor.check();

  // An old recipe must not vouch for new files, should the machine stop between the renames.
  const double before_writing_s = seconds_since_start();
  std::filesystem::remove(paths.recipe);
  for (const auto& path : {paths.volume, o.mesh, o.preview})
    if (!path.parent_path().empty()) make_folder(path.parent_path());
  extraction.volume.set_metadata("program", std::string(kProgram) + " " + std::string(kVersion));
  write_vdb(extraction.volume, paths.volume);
  if (!o.mesh.empty()) write_mesh(extraction.mesh, o.mesh, std::string(kProgram) + " of a model " + sha256.substr(0, 16));
  AtomicFiles files;
  if (!o.preview.empty()) files.add(o.preview, encode_png(preview(extraction.mesh)));
  std::string result = paths.volume.string() + "\n";
  for (const auto& path : {o.mesh, o.preview})
    if (!path.empty()) result += path.string() + "\n";
  result += summary_text(o, extraction, scores);
  const double write_s = seconds_since_start() - before_writing_s;
  files.add(paths.report, report_json(o, extraction, scores, write_s, result).dump(2) + "\n");
  files.add(paths.recipe, recipe_text(make_recipe(kProgram, request, Json::object())));
  files.commit();
  return result;
}

}  // namespace sarnerf::app
