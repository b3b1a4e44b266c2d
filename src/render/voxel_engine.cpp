// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/voxel_engine.h"

#include <algorithm>
#include <atomic>
#include <chrono>

#include "blank.h"
#include "plan.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "voxel_scene.h"
#include "voxel_view.h"

namespace sarnerf {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct VoxelEngine::State {
  State(const Scene& s, Volume volume) : scene(s, std::move(volume)) {}

  VoxelScene scene;
  std::vector<std::string> warnings;
  double build_s = 0.0;
};

VoxelEngine::VoxelEngine(const Scene& scene, Volume volume) {
  if (volume.n_occupied_voxels == 0 && !scene.ground) {
    throw GeometryError("the volume has no voxel with extinction or scattering, and there is no ground: "
                        "there is nothing to render");
  }
  const auto start = std::chrono::steady_clock::now();
  state_ = std::make_unique<State>(scene, std::move(volume));
  state_->build_s = seconds_since(start);
}

VoxelEngine::~VoxelEngine() = default;

const std::vector<std::string>& VoxelEngine::warnings() const { return state_->warnings; }
double VoxelEngine::build_s() const { return state_->build_s; }
std::uint64_t VoxelEngine::memory_bytes() const { return state_->scene.memory_bytes(); }

ViewPlan VoxelEngine::plan(const Acquisition& acquisition, const Sampling& sampling) const {
  ViewPlan plan = plan_voxel_view(state_->scene.planned(), state_->scene.volume, acquisition, sampling);
  // The boxes of matter are carried to the aim point for each view.
  plan.memory_bytes += state_->scene.boxes_m.size() * sizeof(Box);
  return plan;
}

RenderedView VoxelEngine::render(const ViewPlan& plan, const Monitor& monitor) const {
  const auto start = std::chrono::steady_clock::now();
  const Acquisition& a = plan.acquisition;
  RenderedView out;
  out.beta0 = Image<float>(a.n_azimuth, a.n_range);
  out.layers = Layers(plan.layers.layers, a.n_azimuth, a.n_range);
  const Scene planned = state_->scene.planned();
  if (plan.fan.n_elevation == 0) {
    out.warnings.push_back(explain_blank(planned, plan, BlankEvidence{0, true}));
    return out;
  }

  const VoxelView view(state_->scene, plan);
  std::vector<std::unique_ptr<VoxelWorker>> workers;
  for (int n = 0; n < thread_count(); ++n) {
    workers.push_back(std::make_unique<VoxelWorker>(view.make_worker()));
  }
  std::atomic<std::size_t> n_rows_done{0};
  parallel_for(static_cast<std::size_t>(a.n_azimuth), 1, [&](std::size_t begin, std::size_t end, int worker) {
    for (std::size_t i = begin; i < end; ++i) {
      view.render_row(static_cast<int>(i), *workers[static_cast<std::size_t>(worker)], out, monitor);
      // One worker reports for all: reports must not overlap.
      const std::size_t done = ++n_rows_done;
      if (worker == 0) monitor.report("rendering rows", done, static_cast<std::uint64_t>(a.n_azimuth));
    }
  });

  for (const auto& w : workers) out.n_hits += w->n_hits;
  out.trace_and_deposit_s = seconds_since(start);
  if (std::none_of(out.beta0.pixels().begin(), out.beta0.pixels().end(), [](float p) { return p > 0.0f; })) {
    out.warnings.push_back(explain_blank(planned, plan, BlankEvidence{out.n_hits, true}));
  }
  return out;
}

}  // namespace sarnerf
