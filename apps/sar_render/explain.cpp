// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <algorithm>
#include <numeric>

#include "console.h"
#include "products.h"
#include "sarnerf/core/text.h"
#include "values.h"

namespace sarnerf::app {
namespace {

/// Rounds an estimate: neither microseconds, nor hours in seconds.
std::string duration_text(double seconds) {
  if (seconds < 0.01) return "less than 0.01 s";
  if (seconds < 9.95) return format("about %.2g s", seconds);
  if (seconds < 119.5) return format("about %.0f s", seconds);
  if (seconds < 119.5 * 60) return format("about %.0f minutes", seconds / 60);
  return format("about %.0f hours", seconds / 3600);
}

/// A table of labels and lines; a label is printed once.
class Table {
 public:
  void add(const std::string& label, const std::string& line) {
    const bool repeated = label == last_;
    text_ += format("  %-10s ", repeated ? "" : label.c_str()) + visible(line) + "\n";
    last_ = label;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_, last_;
};

std::string range_text(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (values.size() == 1) return format("%.10g", *least);
  return format("%.10g to %.10g", *least, *most);
}

std::string material_text(const Material& m) {
  if (m.opaque) return format("%s: opaque, gamma0 %.4g, exponent %.4g", m.name.c_str(), m.gamma0, m.exponent);
  return format("%s: translucent, extinction %.4g 1/m, scattering %.4g 1/m", m.name.c_str(),
                m.extinction_per_m, m.scattering_per_m);
}

void add_scene(const Job& job, Table& table) {
  const Scene& scene = *job.scene;
  const auto n_closed = std::count_if(scene.pieces.begin(), scene.pieces.end(),
                                      [](const Piece& piece) { return piece.closed; });
  if (job.options.volume()) {
    table.add("scene", format("%s: a volume", job.options.scene.filename().c_str()));
  } else {
    table.add("scene", job.options.scene.filename().string() + ": " +
                           counted(scene.mesh.triangles.size(), "triangle", "triangles") + " in " +
                           counted(scene.pieces.size(), "piece", "pieces") + format(", %td closed", n_closed));
  }
  if (job.built.voxel) {
    table.add("voxels", format("%llu occupied, %.4g m a side",
                               static_cast<unsigned long long>(job.built.n_voxels),
                               job.built.voxel_size_m));
  }
  if (!scene.box.empty()) {
    const glm::dvec3 size = scene.box.size();
    table.add("scene", format("%.6g x %.6g x %.6g m (x, y up, z)", size.x, size.y, size.z));
  }
  for (const Material& material : scene.materials) table.add("material", material_text(material));
  table.add("ground", scene.ground
                          ? format("%s at %.6g m", scene.materials[scene.ground->material].name.c_str(),
                                   scene.ground->height_m)
                          : std::string("none"));
}

void add_views(const Job& job, Table& table) {
  const Options& o = job.options;
  std::vector<double> depression_deg, slant_range_m;
  for (const double angle : o.incidence_deg) depression_deg.push_back(90.0 - angle);
  for (const Acquisition& view : job.views) slant_range_m.push_back(view.slant_range_m);
  const auto [nearest, farthest] = std::minmax_element(slant_range_m.begin(), slant_range_m.end());
  table.add("views", format("%zu, azimuth %s deg", job.views.size(), range_text(o.azimuth_deg).c_str()) +
                         (o.azimuth_deg.size() > 1 && o.incidence_deg.size() > 1
                              ? format(" (%zu) at %zu incidences", o.azimuth_deg.size(), o.incidence_deg.size())
                              : ""));
  table.add("views", format("incidence %s deg, depression %s deg", range_text(o.incidence_deg).c_str(),
                            range_text(depression_deg).c_str()));
  const std::string range = *nearest == *farthest ? format("%.8g m", *nearest)
                                                  : format("%.8g to %.8g m", *nearest, *farthest);
  table.add("radar", "slant range " + range + ", looking " +
                         (o.look == Look::left ? "left" : "right"));
  table.add("aim", format("%.8g, %.8g, %.8g m%s", job.aim_m.x, job.aim_m.y, job.aim_m.z,
                          o.aim_m ? "" : " (centre of the scene at its lowest height)"));
  table.add("image", format("%d x %d pixels (azimuth x range) of %.6g x %.6g m, %s, %s", o.size->first,
                            o.size->second, o.spacing_m.first, o.spacing_m.second,
                            std::string(name(o.calibration)).c_str(),
                            std::string(name(o.quantity)).c_str()));
}

void add_formation(const Job& job, Table& table) {
  for (const std::string& line : formation_lines(job.options, job.border)) table.add("formation", line);
}

void add_cost(const Job& job, Table& table) {
  const auto [n_grid, n_kept, expected_s, files_s] = planned_cost(job);
  table.add("rays", format("%llu of %llu in the grids meet the scene's box: only these are traced",
                           static_cast<unsigned long long>(n_kept),
                           static_cast<unsigned long long>(n_grid)));
  table.add("memory", "about " + bytes_text(job.memory_bytes));
  const std::string files = files_s > 0.05 * expected_s && files_s > 0.1 ? " and " + duration_text(files_s) + " of making files" : "";
  table.add("time", format("%s of tracing%s on %s%s", duration_text(expected_s).c_str(), files.c_str(),
                           counted(static_cast<std::size_t>(job.options.shared.n_threads), "thread", "threads").c_str(),
                           job.n_views_at_once > 1 ? ", one view each"
                           : job.views.size() > 1  ? ", all on one view after the other"
                                                   : ""));
}

void add_layers(const Job& job, Table& table) {
  if (!job.options.layers.empty()) {
    table.add("layers", layers_line(job.options.layers) + format("; reference plane at %.6g m", job.reference_height_m));
  }
}

/// Lines of the first view, marked where other views differ.
void add_plan_lines(const Job& job, std::vector<std::string> ViewPlan::*lines, const char* label, Table& table) {
  for (const std::string& line : job.plans.front().*lines) {
    const bool everywhere = std::all_of(job.plans.begin(), job.plans.end(), [&](const ViewPlan& plan) {
      return std::find((plan.*lines).begin(), (plan.*lines).end(), line) != (plan.*lines).end();
    });
    table.add(label, line + (everywhere ? "" : " [first view; others differ]"));
  }
}

void add_choices(const Job& job, Table& table) {
  if (!job.framing.empty()) table.add("chosen", job.framing);
  for (const std::string& line : job.built.notes) table.add("chosen", line);
  add_plan_lines(job, &ViewPlan::chosen, "chosen", table);
  add_plan_lines(job, &ViewPlan::left_out, "left out", table);
  const std::string unused = formation_left_out(job.options.formation);
  if (!unused.empty()) table.add("left out", unused);
}

}  // namespace

std::string explain(const Job& job, const std::string& place) {
  Table table;
  add_scene(job, table);
  add_views(job, table);
  add_formation(job, table);
  add_layers(job, table);
  add_choices(job, table);
  add_cost(job, table);
  table.add("output", place);
  std::string text = "plan\n" + table.text();
  text.pop_back();
  return text;
}

}  // namespace sarnerf::app
