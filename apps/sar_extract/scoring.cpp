// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include <nlohmann/json.hpp>

#include "job.h"
#include "nerf_common.h"
#include "output_files.h"
#include "output_lock.h"
#include "process.h"
#include "torch_setup.h"
#include "sarnerf/bake/extract.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/report/page.h"
#include "values.h"

namespace sarnerf::app {

namespace {

/// A truth larger or smaller by this factor is in other units, or another scene.
constexpr double kOtherUnits = 3.0;

std::string number(double value, const char* format) {
  if (!std::isfinite(value)) return "-";
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Images that the model was learned from; empty, with a note on the console, if they are not available.
std::vector<PosedImage> training_images(const Options& o, const ModelInfo& info, Console& console,
                                        const Monitor& monitor) {
  if (o.images == "none") return {};
  const std::filesystem::path folder = o.images == "auto" ? info.dataset : o.images;
  try {
    const Dataset dataset = read_manifest(folder);
    if (o.images == "auto" && dataset_fingerprint(folder, dataset, monitor) != info.dataset_sha256)
      throw InputError(folder.string() + ": other images than those of the training");
    const std::vector<std::size_t> of_training = trained_views(dataset.views, info.training_views);
    if (of_training.empty()) throw InputError(folder.string() + ": has no image of a name that the model was learned from");
    return load_images(folder, dataset, of_training, monitor);
  } catch (const InputError& error) {
    if (o.images != "auto") throw;
    console.note(std::string("the carving baseline is left out (--images): ") + error.what());
    return {};
  }
}

Json distances_json(const SurfaceDistances& d) {
  return {{"completeness_m", d.completeness_m},
          {"accuracy_m", d.accuracy_m},
          {"chamfer_m", d.chamfer_m},
          {"hausdorff_m", d.hausdorff_m},
          {"percentile95_m", d.percentile95_m}};
}

Json score_json(const SurfaceScore& s) {
  const auto vector = [](const glm::dvec3& v) { return Json{v.x, v.y, v.z}; };
  return {{"iou", s.iou},
          {"precision", s.precision},
          {"recall", s.recall},
          {"volume_m3", s.volume_m3},
          {"truth_volume_m3", s.truth_volume_m3},
          {"volume_error", s.volume_error},
          {"symmetric_difference_m", s.symmetric_difference_m},
          {"observable_iou", s.observable_iou},
          {"hull_iou", s.hull_iou},
          {"box_min_error_m", vector(s.box_min_error_m)},
          {"box_max_error_m", vector(s.box_max_error_m)},
          {"size_ratio", s.size_ratio},
          {"whole", distances_json(s.whole)},
          {"visible", distances_json(s.visible)},
          {"visible_normal_error_deg", s.normal_error_rad * 180.0 / std::numbers::pi},
          {"visible_fraction", s.visible_fraction},
          {"completeness_alone_m", s.completeness_alone_m},
          {"completeness_laid_over_m", s.completeness_laid_over_m},
          {"laid_over_fraction", s.laid_over_fraction},
          {"column_spacing_m", s.column_spacing_m},
          {"open_fraction", s.open_fraction}};
}

Box box_of(const SurfaceMesh& mesh) {
  Box box_m;
  for (const glm::uvec3& t : mesh.triangles)
    for (int corner = 0; corner < 3; ++corner) box_m.include(mesh.vertices_m[t[corner]]);
  return box_m;
}

/// Warns if the surfaces' boxes do not overlap: they are of different scenes, or in different frames.
void warn_if_apart(const SurfaceMesh& extracted, const SurfaceMesh& truth, Console& console) {
  const Box a = box_of(extracted), b = box_of(truth);
  if (a.empty() || b.empty()) return;
  if (glm::all(glm::lessThanEqual(a.min, b.max)) && glm::all(glm::lessThanEqual(b.min, a.max))) return;
  const glm::dvec3 here = a.centre(), there = b.centre();
  console.warning(format("what was extracted, around %.6g, %.6g, %.6g m, and the truth, around %.6g, %.6g, %.6g m, have no "
                         "place in common: another scene, another up axis (--truth-up), other units (--truth-units), or "
                         "another origin",
                         here.x, here.y, here.z, there.x, there.y, there.z));
}

std::vector<std::string> row(const std::string& name, const SurfaceScore& s) {
  double box_m = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    box_m = std::max({box_m, std::abs(s.box_min_error_m[axis]), std::abs(s.box_max_error_m[axis])});
  return {name,
          number(s.iou, "%.3f"),
          number(s.observable_iou, "%.3f"),
          number(s.symmetric_difference_m, "%.3f"),
          number(s.precision, "%.3f"),
          number(s.recall, "%.3f"),
          number(100.0 * s.volume_error, "%+.1f %%"),
          number(box_m, "%.2f"),
          number(s.whole.chamfer_m, "%.3f"),
          number(s.whole.hausdorff_m, "%.2f"),
          number(s.visible.chamfer_m, "%.3f"),
          number(s.visible.hausdorff_m, "%.2f")};
}

}  // namespace

Truth load_truth(const Options& o, Console& console, const Monitor& monitor) {
  LoadOptions options = o.truth_options;
  options.max_memory_bytes = o.shared.max_memory_bytes;
  options.monitor = monitor;
  const Scene scene = load_scene(o.truth, options);
  for (const std::string& note : scene.report.notes) console.detail(note);
  for (const std::string& warning : scene.report.warnings) console.warning(warning);
  Truth truth{truth_of(scene), {}, scene.report.files};
  ScoreOptions score_options;
  score_options.monitor = monitor;
  truth.volume = truth_volume(truth.surface, score_options);
  if (truth.volume.volume != TruthVolume::none && !truth.volume.reason.empty())
    console.note(o.truth.filename().string() + ": " + truth.volume.reason);
  return truth;
}

Witnesses witnesses_of(const Options& o, const ModelInfo& info, Console& console, const Monitor& monitor) {
  Witnesses witnesses;
  for (const DatasetView& view : info.training_views) witnesses.views.push_back(acquisition_of(view, info.aim_m));
  witnesses.images = training_images(o, info, console, monitor);
  return witnesses;
}

Scores score_mesh(const Truth& truth, const SurfaceMesh& mesh, const Witnesses& witnesses, const CarvingLattice& lattice,
                  std::optional<double> ground_height_m, Console& console, const Monitor& monitor) {
  const Stopwatch watch;
  ScoreOptions options;
  options.truth_volume = truth.volume.volume;
  options.monitor = monitor;
  Scores scores;
  scores.truth_volume = truth.volume;
  warn_if_apart(mesh, truth.surface.all, console);
  scores.extracted = score(mesh, truth.surface, witnesses.views, options);
  constexpr double kHoles = 0.01;
  if (scores.extracted.open_fraction > kHoles)
    console.warning(format("the mesh has holes: %.0f %% of the vertical lines through it do not leave where they entered; its volume, and all "
                           "scores of volumes, are unreliable", 100.0 * scores.extracted.open_fraction));
  const double ratio = scores.extracted.size_ratio;
  if (ratio > 0.0 && (ratio > kOtherUnits || ratio < 1.0 / kOtherUnits)) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "what was extracted is %.3g times as large as the truth; if that is in other units, --truth-units or "
                  "--truth-scale say so",
                  ratio);
    console.warning(text);
  }
  if (!witnesses.images.empty()) {
    const SurfaceMesh carved = carved_solid(witnesses.images, lattice, ground_height_m, monitor);
    scores.carved = score(carved, truth.surface, witnesses.views, options);
  }
  scores.seconds = watch.seconds();
  return scores;
}

namespace {

/// All views of a dataset folder.
Witnesses witnesses_of_dataset(const std::filesystem::path& folder, bool with_images, const Monitor& monitor) {
  const Dataset dataset = read_manifest(folder);
  Witnesses witnesses;
  for (const DatasetView& view : dataset.views) witnesses.views.push_back(acquisition_of(view, dataset.aim_m));
  if (with_images) {
    std::vector<std::size_t> all(dataset.views.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    witnesses.images = load_images(folder, dataset, all, monitor);
  }
  return witnesses;
}

}  // namespace

std::string score_and_write(const Options& o, Console& console, const Monitor& monitor) {
  const std::filesystem::path output = o.score.string() + ".score.json";
  const std::vector<std::filesystem::path> inputs{o.model, o.truth, o.score, o.shared.config_file};
  for (const auto& path : {output, o.preview}) {
    if (path.empty()) continue;
    refuse_input(path, inputs);
    if (!o.overwrite && std::filesystem::exists(path)) throw UsageError(path.string() + ": exists; allow --overwrite");
  }
  if (o.dry_run)
    return "plan\n  score     " + o.score.string() + " against " + o.truth.string() + ", with the views of " + o.model.string() +
           "\n  output    " + output.string() + (o.preview.empty() ? "" : ", " + o.preview.string()) + "\n";
  const bool of_dataset = std::filesystem::exists(o.model / "dataset.json");
  const Truth truth = load_truth(o, console, monitor);
  LoadOptions as_it_is;
  as_it_is.monitor = monitor;
  const Scene scene = load_scene(o.score, as_it_is);
  for (const std::string& warning : scene.report.warnings) console.warning(warning);
  const Witnesses witnesses = of_dataset ? witnesses_of_dataset(o.model, o.images != "none", monitor)
                                         : witnesses_of(o, open_model(o.model, console).info, console, monitor);
  // Carving has the cube that an extraction of these options would have, about the truth.
  const Box box_m = box_of(truth.surface.all);
  const int resolution = o.extract.resolution > 0 ? o.extract.resolution : ExtractOptions{}.resolution;
  const glm::dvec3 centre_m = o.extract.centre_m.value_or(box_m.empty() ? glm::dvec3(0.0) : box_m.centre());
  const CarvingLattice lattice{{centre_m - 0.5 * o.extract.extent_m, centre_m + 0.5 * o.extract.extent_m}, o.extract.extent_m / resolution};
  const SurfaceMesh mesh{scene.mesh.vertices_m, scene.mesh.triangles};
  const Scores scores = score_mesh(truth, mesh, witnesses, lattice, o.extract.ground_height_m, console, monitor);
  const Json report{{"format", "sarnerf-report"}, {"version", 1}, {"mesh", o.score.filename().string()},
                    {"truth", o.truth.filename().string()}, {"scores", scores_json(scores)}};
  AtomicFiles files;
  if (!o.preview.empty()) files.add(o.preview, encode_png(preview(mesh)));
  files.add(output, valid_text(report).dump(2) + "\n");
  files.commit();
  return (o.shared.verbosity < 0 ? "" : table_text(scores)) + output.string() + "\n" +
         (o.preview.empty() ? "" : o.preview.string() + "\n");
}

std::string table_text(const Scores& scores) {
  const std::vector<TableColumn> columns{{"body"},
                                         {"IoU", Align::right},
                                         {"observable", Align::right},
                                         {"difference (m)", Align::right},
                                         {"precision", Align::right},
                                         {"recall", Align::right},
                                         {"volume", Align::right},
                                         {"box (m)", Align::right},
                                         {"Chamfer (m)", Align::right},
                                         {"Hausdorff (m)", Align::right},
                                         {"visible: Chamfer (m)", Align::right},
                                         {"Hausdorff (m)", Align::right}};
  std::vector<std::vector<std::string>> rows{row("extracted", scores.extracted)};
  if (scores.carved) rows.push_back(row("carving alone", *scores.carved));
  std::string text = markdown_table(columns, rows);
  const SurfaceScore& s = scores.extracted;
  if (!std::isnan(s.laid_over_fraction))
    text += format("visible true surface to the body: %s m where some view sees it alone, %s m in layover (%.0f %% of it)\n",
                   number(s.completeness_alone_m, "%.3f").c_str(), number(s.completeness_laid_over_m, "%.3f").c_str(),
                   100.0 * s.laid_over_fraction);
  if (scores.truth_volume.volume == TruthVolume::none) text += "no volumes of the truth: " + scores.truth_volume.reason + "\n";
  return text;
}

Json scores_json(const Scores& scores) {
  Json j{{"extracted", score_json(scores.extracted)}};
  j["truth_volume"] = {{"kind", name(scores.truth_volume.volume)}, {"reason", scores.truth_volume.reason}};
  if (scores.carved) j["carving"] = score_json(*scores.carved);
  return j;
}

namespace {

std::string box_text(const Box& box_m) {
  if (box_m.empty()) return "-";
  return format("%.4g..%.4g, %.4g..%.4g, %.4g..%.4g", box_m.min.x, box_m.max.x, box_m.min.y, box_m.max.y, box_m.min.z,
                box_m.max.z);
}

std::string details_of(const Extraction& x) {
  const VdbSummary volume = x.volume.summary();
  std::vector<std::vector<std::string>> rows;
  for (const VdbGridSummary& grid : volume.grids)
    rows.push_back({grid.name, grid.type, std::to_string(grid.n_active_voxels), box_text(grid.box_m),
                    bytes_text(grid.memory_bytes)});
  std::string text = markdown_table(
      {{"grid"}, {"type"}, {"voxels", Align::right}, {"box x, y, z (m)"}, {"memory", Align::right}}, rows);
  for (const auto& [name, value] : volume.metadata) text += name + ": " + value + "\n";
  if (x.is_surface) return text;
  return text + format("threshold %.3g per metre\n", x.threshold_per_m);
}

std::string closing_line(const Extraction& x, const std::optional<Scores>& scores) {
  const bool surface = x.is_surface;
  std::string text = format("%s: %zu triangles, down to %.3g m, from voxels of %.3g m", surface ? "surface" : "matter",
                            x.mesh.triangles.size(), x.bottom_m, x.voxel_size_m);
  if (!surface) text += format(", where extinction is at least %.3g per metre", x.threshold_per_m);
  if (surface) {
    text += "; " + counted(x.n_components, "component");
    if (x.n_unseen_components > 0) text += format(", %zu of them removed, which no view sees", x.n_unseen_components);
    const glm::dvec3& m = x.largest_component_m;
    text += format("; the largest is %.3g x %.3g x %.3g m", m.x, m.y, m.z);
    text += format("; %.0f %% of the surface unseen", 100.0 * x.unseen_part);
  }
  if (scores) text += format("; %.0f %% of the true surface seen", 100.0 * scores->extracted.visible_fraction);
  return text + "; memory " + bytes_text(peak_memory_bytes()) + "\n";
}

/// Names every kind of grid; an abbreviated list would hide some. The nine harmonics are of one kind.
std::string grids_text(const std::vector<std::string>& grids) {
  std::string text;
  std::size_t n_harmonics = 1;
  for (const std::string& name : grids) n_harmonics += name.starts_with("brightness_") ? 1 : 0;
  for (const std::string& name : grids) {
    if (name.starts_with("brightness_")) continue;
    text += (text.empty() ? "" : ", ") + name;
    if (name == "brightness" && n_harmonics > 1) text += " (" + std::to_string(n_harmonics) + " harmonics)";
  }
  return text;
}

}  // namespace

std::string Printed::text(const Options& options) const {
  if (options.shared.verbosity < 0) return paths;
  return paths + (options.shared.verbosity > 0 || options.explain ? details : "") + summary;
}

Json Printed::json() const { return {{"paths", paths}, {"details", details}, {"summary", summary}}; }

std::optional<Printed> Printed::from(const Json& json) {
  const auto has = [&](const char* name) { return json.contains(name) && json[name].is_string(); };
  if (!json.is_object() || !has("paths") || !has("details") || !has("summary")) return std::nullopt;
  return Printed{json["paths"], json["details"], json["summary"]};
}

Printed printed_of(const Options& o, const Extraction& x, const std::optional<Scores>& scores) {
  Printed printed;
  for (const auto& path : {o.output, o.mesh, o.preview})
    if (!path.empty()) printed.paths += path.string() + "\n";
  printed.details = details_of(x);
  printed.summary = (scores ? table_text(*scores) : "") + closing_line(x, scores);
  return printed;
}

std::string plan_text(const Options& o, const Model& model) {
  const ExtractOptions& e = o.extract;
  const ExtractionPlan plan = plan_extraction(model, e);
  std::string text = "plan\n  model     " + std::string(model.field->kind()) + ", " + model.field->size_text() + ", of " +
                     std::to_string(model.info.training_views.size()) + " views";
  text += e.resolution == 0 ? format("\n  volume    the learned lattice, voxels of %.3g m", plan.voxel_size_m)
                            : format("\n  volume    %d^3 over %.4g m, voxels of %.3g m", e.resolution, e.extent_m,
                                     plan.voxel_size_m);
  text += "\n            " + box_text(plan.box_m) + " m (x, y, z)";
  if (plan.part_outside > 0.01)
    text += format("\n            cuts off %.1f %% of the box of what was learned", 100.0 * plan.part_outside);
  text += format("\n  grids     %s; up to %zu voxels each", grids_text(plan.grids).c_str(), plan.n_voxels);
  text += model.field->kind() == "surface" ? std::string("\n  body      where the distance is below 0; what no view sees is marked, ") +
                                                 (!e.unseen ? "and a membrane, unless a ground bounds it"
                                                  : *e.unseen == Unseen::membrane ? "and a membrane"
                                                                                  : "and as large as views allow")
          : e.threshold_per_m ? format("\n  body      where extinction is at least %.3g per metre", *e.threshold_per_m)
                              : std::string("\n  body      where extinction is at least Otsu's threshold");
  text += "\n  left out  voxels without extinction; insides";
  if (o.truth.empty()) text += "; scores: no --truth";
  if (o.mesh.empty()) text += "; mesh file: no --mesh";
  if (o.preview.empty()) text += "; picture: no --preview";
  text += "\n  memory    about " + bytes_text(plan.voxel_bytes) + " for voxels, and the program's own";
  text += "\n  output    " + o.output.string();
  for (const auto& path : {o.mesh, o.preview})
    if (!path.empty()) text += ", " + path.string();
  return text;
}

}  // namespace sarnerf::app
