// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/surface_engine.h"

#include <algorithm>
#include <atomic>
#include <chrono>

#include "blank.h"
#include "nested_images.h"
#include "plan.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "surface_scene.h"
#include "surface_view.h"

namespace sarnerf {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct SurfaceEngine::State {
  explicit State(const Scene& s) : scene(s) {}

  SurfaceScene scene;
  double build_s = 0.0;
};

SurfaceEngine::SurfaceEngine(const Scene& scene) {
  if (scene.mesh.triangles.empty() && !scene.ground) {
    throw GeometryError("the scene has neither triangles nor a ground: there is nothing to render");
  }
  const auto start = std::chrono::steady_clock::now();
  state_ = std::make_unique<State>(scene);
  state_->build_s = seconds_since(start);
}

SurfaceEngine::~SurfaceEngine() = default;

const std::vector<std::string>& SurfaceEngine::warnings() const { return state_->scene.warnings; }
double SurfaceEngine::build_s() const { return state_->build_s; }
std::uint64_t SurfaceEngine::memory_bytes() const { return state_->scene.memory_bytes(); }

ViewPlan SurfaceEngine::plan(const Acquisition& acquisition, const Sampling& sampling) const {
  return plan_view(state_->scene.scene, state_->scene.media.box_m(), acquisition, sampling);
}

RenderedView SurfaceEngine::render(const ViewPlan& plan, const Monitor& monitor) const {
  const auto start = std::chrono::steady_clock::now();
  const Acquisition& a = plan.acquisition;
  RenderedView out;
  out.beta0 = Image<float>(a.n_azimuth, a.n_range);
  out.layers = Layers(plan.layers.layers, a.n_azimuth, a.n_range);
  if (plan.fan.n_elevation == 0) {
    out.warnings.push_back(explain_blank(state_->scene.scene, plan, BlankEvidence{}));
    return out;
  }

  std::optional<NestedImages> nested;
  const std::string unknown = why_error_is_unknown(plan);
  if (plan.error.estimate && unknown.empty()) nested.emplace(plan);
  const SurfaceView view(state_->scene, plan, nested ? &*nested : nullptr);
  std::vector<SurfaceWorker> workers;
  for (int n = 0; n < thread_count(); ++n) workers.push_back(view.make_worker());
  std::atomic<std::size_t> n_rows_done{0};
  parallel_for(static_cast<std::size_t>(a.n_azimuth), 1, [&](std::size_t begin, std::size_t end, int worker) {
    for (std::size_t i = begin; i < end; ++i) {
      monitor.check();
      view.render_row(static_cast<int>(i), workers[static_cast<std::size_t>(worker)], out, monitor);
      // One worker reports for all: reports must not overlap.
      const std::size_t done = ++n_rows_done;
      if (worker == 0) monitor.report("rendering rows", done, static_cast<std::uint64_t>(a.n_azimuth));
    }
  });

  for (const SurfaceWorker& w : workers) out.n_hits += w.n_hits;
  if (nested) out.error = nested->estimate(out.beta0);
  if (nested && plan.error.map) out.layers.error = std::move(out.error.map);
  if (plan.error.estimate && !unknown.empty()) out.warnings.push_back("the error cannot be estimated: " + unknown);
  out.trace_and_deposit_s = seconds_since(start);
  if (std::none_of(out.beta0.pixels().begin(), out.beta0.pixels().end(), [](float p) { return p > 0.0f; })) {
    out.warnings.push_back(explain_blank(state_->scene.scene, plan, BlankEvidence{out.n_hits}));
  }
  return out;
}

}  // namespace sarnerf
