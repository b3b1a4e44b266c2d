// SPDX-License-Identifier: Apache-2.0
#include "printed.h"

#include <nlohmann/json.hpp>

#include "process.h"
#include "sarnerf/core/format.h"
#include "sarnerf/report/table.h"
#include "values.h"

namespace sarnerf::app {
namespace {

std::string box_text(const Box& box_m) {
  if (box_m.empty()) return "-";
  return format("%.4g..%.4g, %.4g..%.4g, %.4g..%.4g", box_m.min.x, box_m.max.x, box_m.min.y, box_m.max.y, box_m.min.z,
                box_m.max.z);
}

std::string details_of(const Options& o, const Extraction& x) {
  const VdbSummary volume = x.volume.summary();
  std::vector<std::vector<std::string>> rows;
  for (const VdbGridSummary& grid : volume.grids)
    rows.push_back({grid.name, grid.type, std::to_string(grid.n_active_voxels), box_text(grid.box_m),
                    bytes_text(grid.memory_bytes)});
  std::string text = markdown_table(
      {{"grid"}, {"type"}, {"voxels", Align::right}, {"box x, y, z (m)"}, {"memory", Align::right}}, rows);
  for (const auto& [name, value] : volume.metadata) text += name + ": " + value + "\n";
  const bool threshold_used = o.extract.body == Body::shell || o.extract.threshold_per_m;
  return text + format("threshold %.3g per metre%s\n", x.threshold_per_m, threshold_used ? "" : " (not used: --solid)");
}

std::string closing_line(const Options& o, const Extraction& x, const std::optional<Scores>& scores) {
  std::string text = format("%s: %zu triangles, down to %.3g m%s, from voxels of %.3g m",
                            o.extract.body == Body::solid ? "solid" : "shell", x.mesh.triangles.size(), x.bottom_m,
                            x.bottom_was_given ? "" : " (where returns end: --ground-height)", x.voxel_size_m);
  if (scores) text += format("; %.0f %% of the true surface seen", 100.0 * scores->extracted.visible_fraction);
  return text + "; memory " + bytes_text(peak_memory_bytes()) + "\n";
}

/// "a, b, c, d to z" would hide what a file holds; harmonics are nine of a kind.
std::string grids_text(const std::vector<std::string>& grids) {
  const std::size_t n_brightness = grids.size() - 2;
  return grids.front() + ", brightness" + (n_brightness > 1 ? " (" + std::to_string(n_brightness) + " harmonics)" : "") +
         ", " + grids.back();
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
  printed.details = details_of(o, x);
  printed.summary = (scores ? table_text(*scores) : "") + closing_line(o, x, scores);
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
  text += e.body == Body::solid
              ? format("\n  body      solid: what %zu training views see, and all behind it", plan.n_views)
              : std::string("\n  body      shell: matter denser than the threshold");
  text += "\n  left out  voxels without extinction; insides, which are tiles";
  if (o.truth.empty()) text += "; scores: no --truth";
  if (o.mesh.empty()) text += "; mesh file: no --mesh";
  if (o.preview.empty()) text += "; picture: no --preview";
  text += "\n  memory    about " + bytes_text(plan.voxel_bytes) + " for voxels and " + bytes_text(plan.view_bytes) +
          " for what views see, and the program's own";
  text += "\n  output    " + o.output.string();
  for (const auto& path : {o.mesh, o.preview})
    if (!path.empty()) text += ", " + path.string();
  return text;
}

}  // namespace sarnerf::app
