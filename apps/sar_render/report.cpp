// SPDX-License-Identifier: Apache-2.0
#include "report.h"

#include <sys/resource.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "version.h"

namespace sarnerf::app {
namespace {

/// Largest resident size of this process so far.
std::uint64_t peak_memory_bytes() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

std::string summary(const RunFigures& figures) {
  char text[240];
  std::snprintf(text, sizeof text,
                "rendered %zu view%s in %.3g s: tracing and deposit %.3g s, image formation %.3g s, encoding "
                "%.3g s, writing %.3g s (summed over views)",
                figures.n_rendered, figures.n_rendered == 1 ? "" : "s", figures.total_s,
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
