// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "version.h"
#include <nlohmann/json.hpp>

#include "job.h"
#include "process.h"
#include "products.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"

namespace sarnerf::app {

namespace {

template <class Value>
Json or_auto(const std::optional<Value>& value) {
  return value ? Json(*value) : Json("auto");
}

Json count_or_auto(int count) { return count > 0 ? Json(count) : Json("auto"); }

/// Only the name: the folder of a file has no effect on the image.
Json fingerprint(const std::filesystem::path& path) {
  return {{"file", path.filename().string()}, {"sha256", sha256_of_file(path)}};
}

Json scene_request(const Options& o) {
  Json j = fingerprint(o.scene);
  j["units_m"] = o.units_m;
  j["scale"] = o.scale;
  j["up"] = o.up == UpAxis::z ? "z" : "y";
  if (o.volume()) j["extinction_per_density"] = o.extinction_per_density;
  if (!o.materials.empty()) j["materials"] = fingerprint(o.materials);
  if (o.ground) j["ground"] = *o.ground;
  j["ground_height_m"] = or_auto(o.ground_height_m);
  return j;
}

Json views_request(const Options& o) {
  Json j;
  j["incidence_deg"] = o.incidence_deg;
  j["depression_deg"] = Json::array();
  for (const double angle : o.incidence_deg) j["depression_deg"].push_back(90.0 - angle);
  j["azimuth_deg"] = o.azimuth_deg;
  if (o.slant_range_m) {
    j["slant_range_m"] = *o.slant_range_m;
  } else {
    j["altitude_m"] = o.altitude_m;
  }
  j["look"] = o.look == Look::left ? "left" : "right";
  j["aim_m"] = o.aim_m ? Json{o.aim_m->x, o.aim_m->y, o.aim_m->z} : Json("auto");
  return j;
}

}  // namespace

Json request_of(const Options& o) {
  Json j;
  j["scene"] = scene_request(o);
  j["views"] = views_request(o);
  j["image"] = {{"size", o.size ? Json{o.size->first, o.size->second} : Json("auto")},
                {"spacing_m", {o.spacing_m.first, o.spacing_m.second}},
                {"calibration", name(o.calibration)},
                {"quantity", name(o.quantity)}};
  if (o.formation.any()) j["formation"] = formation_request(o.formation);
  if (!o.layers.empty()) j["layers"] = layers_request(o.layers);
  j["computation"] = {{"engine", name(o.engine)},
                      {"voxel_size_m", or_auto(o.voxel_size_m)},
                      {"elevations", count_or_auto(o.sampling.n_elevation)},
                      {"sub_rows", count_or_auto(o.sampling.n_slices)},
                      {"integrator", name(o.sampling.integrator)}};
  if (o.tolerance) j["computation"]["error"] = *o.tolerance;
  return valid_text(j);
}

void add(const Products& products, RunFigures& figures) {
  ++figures.n_rendered;
  figures.n_hits += products.n_hits;
  if (std::isnan(products.sampling.error)) {
    ++figures.n_unknown_errors;
  } else {
    figures.errors.push_back(products.sampling.error);
  }
  figures.n_repeated += products.sampling.n_renders - 1;
  figures.trace_and_deposit_s += products.trace_and_deposit_s;
  figures.formation_s += products.formation_s;
  figures.encode_s += products.encode_s;
}

std::string error_line(const RunFigures& figures) {
  const std::size_t n_unknown = figures.n_unknown_errors;
  if (figures.errors.empty()) return n_unknown > 0 ? "the error cannot be estimated" : "";
  const auto [least, most] = std::minmax_element(figures.errors.begin(), figures.errors.end());
  char text[160];
  if (figures.errors.size() == 1) {
    std::snprintf(text, sizeof text, "error about %.2g %% of the image's norm, by its own estimate", 100.0 * *most);
  } else {
    std::snprintf(text, sizeof text, "error about %.2g to %.2g %% of the images' norms, by their own estimates",
                  100.0 * *least, 100.0 * *most);
  }
  if (n_unknown > 0) return text + ("; that of " + counted(n_unknown, "view")) + " cannot be estimated";
  return text;
}

std::string summary(const RunFigures& figures) {
  char text[240];
  std::snprintf(text, sizeof text,
                "rendered %s in %.3g s: tracing and deposit %.3g s, image formation %.3g s, encoding "
                "%.3g s, writing %.3g s (summed over views)",
                counted(figures.n_rendered, "view").c_str(), figures.total_s,
                figures.trace_and_deposit_s, figures.formation_s, figures.encode_s, figures.write_s);
  return text;
}

std::string report_text(const Job& job, const RunFigures& figures) {
  const auto [n_grid, n_kept, expected_s, files_s] = planned_cost(job);
  Json j;
  j["format"] = "sarnerf-report";
  j["version"] = 1;
  j["program"] = "sar_render " + std::string(kVersion);
  j["threads"] = job.options.shared.n_threads;
  j["views_at_once"] = job.n_views_at_once;
  j["views"] = {{"planned", job.views.size()},
                {"rendered", figures.n_rendered},
                {"finished_before", figures.n_reused}};
  j["triangles"] = job.scene->mesh.triangles.size();
  if (job.built.voxel) {
    j["voxels"] = {{"size_m", job.built.voxel_size_m}, {"occupied", job.built.n_voxels}};
  }
  j["rays"] = {{"grid", n_grid}, {"kept", n_kept}, {"hits", figures.n_hits}};
  if (figures.errors.empty() && figures.n_unknown_errors > 0) {
    j["error_estimate"] = nullptr;
  } else if (!figures.errors.empty()) {
    std::vector<double> errors = figures.errors;
    std::sort(errors.begin(), errors.end());
    j["error_estimate"] = {{"least", errors.front()},
                           {"median", errors[errors.size() / 2]},
                           {"most", errors.back()},
                           {"is", "norm of the image's error over its norm, before speckle and noise"}};
    if (figures.n_unknown_errors > 0) j["error_estimate"]["views_unknown"] = figures.n_unknown_errors;
    if (job.options.tolerance) {
      j["error_estimate"]["asked"] = *job.options.tolerance;
      j["error_estimate"]["renders_repeated"] = figures.n_repeated;
    }
  }
  j["seconds"] = {{"read", job.scene->report.read_s},
                  {"repair", job.scene->report.repair_s},
                  {"load", job.times.load_s},
                  {"build", job.times.build_s - job.built.voxelise_s},
                  {"voxelise", job.built.voxelise_s},
                  {"plan", job.times.plan_s},
                  {"trace_and_deposit", figures.trace_and_deposit_s},
                  {"formation", figures.formation_s},
                  {"encode", figures.encode_s},
                  {"write", figures.write_s},
                  {"expected_trace_and_deposit", expected_s},
                  {"expected_encode_and_write", files_s},
                  {"total", figures.total_s}};
  j["seconds_are"] = "wall clock; trace_and_deposit, formation, encode and write summed over views";
  j["memory_bytes"] = {{"expected", job.memory_bytes}, {"peak", peak_memory_bytes()}};
  return j.dump(2) + "\n";
}

}  // namespace sarnerf::app
