// SPDX-License-Identifier: Apache-2.0
#include "scoring.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "sarnerf/bake/carved_solid.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/stopwatch.h"
#include "sarnerf/dataset/fingerprint.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/report/table.h"

namespace sarnerf::app {
namespace {

/// A truth so much larger or smaller is in other units, or another scene.
constexpr double kOtherUnits = 3.0;

std::string number(double value, const char* format) {
  if (!std::isfinite(value)) return "-";
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// Images that the model was learned from; empty where they are not to be had, which the console is told.
std::vector<PosedImage> training_images(const Options& o, const ModelInfo& info, Console& console,
                                        const Monitor& monitor) {
  if (o.images == "none") return {};
  const std::filesystem::path folder = o.images == "auto" ? info.dataset : o.images;
  try {
    const Dataset dataset = read_manifest(folder);
    if (o.images == "auto" && dataset_fingerprint(folder, dataset, monitor) != info.dataset_sha256)
      throw InputError(folder.string() + ": other images than those of the training");
    std::vector<std::size_t> all(dataset.views.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    return load_images(folder, dataset, all, monitor);
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
          {"box_min_error_m", vector(s.box_min_error_m)},
          {"box_max_error_m", vector(s.box_max_error_m)},
          {"size_ratio", s.size_ratio},
          {"whole", distances_json(s.whole)},
          {"visible", distances_json(s.visible)},
          {"visible_fraction", s.visible_fraction},
          {"column_spacing_m", s.column_spacing_m}};
}

Box box_of(const SurfaceMesh& mesh) {
  Box box_m;
  for (const glm::uvec3& t : mesh.triangles)
    for (int corner = 0; corner < 3; ++corner) box_m.include(mesh.vertices_m[t[corner]]);
  return box_m;
}

/// Surfaces that have no place in common are of other scenes, or in other frames.
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
  Truth truth{truth_of(scene), {}};
  ScoreOptions score_options;
  score_options.monitor = monitor;
  truth.volume = truth_volume(truth.surface, score_options);
  if (truth.volume.volume != TruthVolume::none && !truth.volume.reason.empty())
    console.note(o.truth.filename().string() + ": " + truth.volume.reason);
  return truth;
}

Scores score_extraction(const Options& o, const Truth& truth, const Model& model, const Extraction& extraction,
                        Console& console, const Monitor& monitor) {
  const Stopwatch watch;
  std::vector<Acquisition> views;
  for (const DatasetView& view : model.info.training_views) views.push_back(acquisition_of(view, model.info.aim_m));
  ScoreOptions options;
  options.truth_volume = truth.volume.volume;
  options.monitor = monitor;
  Scores scores;
  scores.truth_volume = truth.volume;
  warn_if_apart(extraction.mesh, truth.surface.all, console);
  scores.extracted = score(extraction.mesh, truth.surface, views, options);
  const double ratio = scores.extracted.size_ratio;
  if (ratio > 0.0 && (ratio > kOtherUnits || ratio < 1.0 / kOtherUnits)) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "what was extracted is %.3g times as large as the truth; if that is in other units, --truth-units or "
                  "--truth-scale say so",
                  ratio);
    console.warning(text);
  }
  const std::vector<PosedImage> images = training_images(o, model.info, console, monitor);
  if (!images.empty()) {
    const CarvingLattice lattice{extraction.box_m, extraction.voxel_size_m};
    scores.carved = score(carved_solid(images, lattice, o.extract.ground_height_m, monitor), truth.surface, views, options);
  }
  scores.seconds = watch.seconds();
  return scores;
}

std::string table_text(const Scores& scores) {
  const std::vector<TableColumn> columns{{"body"},
                                         {"IoU", Align::right},
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
  if (scores.truth_volume.volume == TruthVolume::none) text += "no volumes of the truth: " + scores.truth_volume.reason + "\n";
  return text;
}

Json scores_json(const Scores& scores) {
  Json j{{"extracted", score_json(scores.extracted)}};
  j["truth_volume"] = {{"kind", name(scores.truth_volume.volume)}, {"reason", scores.truth_volume.reason}};
  if (scores.carved) j["carving"] = score_json(*scores.carved);
  return j;
}

}  // namespace sarnerf::app
