// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>

#include "error_estimate.h"
#include "plan.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/render/engine.h"
#include "voxel/voxel_scene.h"
#include "voxel/voxel_view.h"

namespace sarnerf {

namespace {

/// Ratio of an image's error to its difference from a coarser image, measured (sar_bench accuracy): voxels of twice
/// the size have 2.1 times the error, mostly of the same sign.
constexpr double kErrorsPerVoxelDifference = 1.0;
constexpr double kErrorsPerRayDifference = 0.4;

/// Renders every `row_step`th row of a view.
void render_rows(const VoxelScene& scene, const ViewPlan& plan, int row_step, RenderedView& out,
                 const Monitor& monitor) {
  const VoxelView view(scene, plan);
  std::vector<std::unique_ptr<VoxelWorker>> workers;
  for (int n = 0; n < thread_count(); ++n) {
    workers.push_back(std::make_unique<VoxelWorker>(view.make_worker()));
  }
  const auto n_rows = static_cast<std::size_t>((plan.acquisition.n_azimuth + row_step - 1) / row_step);
  std::atomic<std::size_t> n_rows_done{0};
  parallel_for(n_rows, 1, [&](std::size_t begin, std::size_t end, int worker) {
    for (std::size_t n = begin; n < end; ++n) {
      view.render_row(static_cast<int>(n) * row_step, *workers[static_cast<std::size_t>(worker)], out, monitor);
      // Only one worker reports progress: reports must not overlap.
      const std::size_t done = ++n_rows_done;
      if (worker == 0) monitor.report("rendering rows", done, n_rows);
    }
  });
  for (const auto& w : workers) out.n_hits += w->n_hits;
}

/// Row step of an estimate without a map: every second row is enough for one number, at half the cost.
constexpr int kEstimatedRows = 2;

Image<float> rows_of(const Image<float>& image, int row_step) {
  Image<float> rows((image.n_azimuth() + row_step - 1) / row_step, image.n_range());
  for (int i = 0; i < rows.n_azimuth(); ++i) {
    std::ranges::copy(image.row(i * row_step), rows.row(i).begin());
  }
  return rows;
}

/// Error of a view, from its difference to a coarser view of half as many elevation rays and half as many slices (at
/// least two). `coarser` is the same volume or, if `of_voxels`, the same scene in voxels of twice the size.
ErrorEstimate estimate(const VoxelScene& coarser, bool of_voxels, const ViewPlan& plan, const Image<float>& image,
                       const Monitor& monitor) {
  ViewPlan coarse = plan;
  coarse.layers = {};
  coarse.fan = make_fan({plan.fan.first_angle_rad, plan.fan.first_angle_rad + plan.fan.step_rad * plan.fan.n_elevation},
                        (plan.fan.n_elevation + 1) / 2);
  // The footprint deposit compares a slice with its neighbours: it needs at least two.
  coarse.n_slices = std::max(2, plan.n_slices / 2);
  coarse.n_slices_at_once = std::min(plan.n_slices_at_once, coarse.n_slices);
  RenderedView rendered;
  rendered.beta0 = Image<float>(image.n_azimuth(), image.n_range());
  const int row_step = plan.error.map ? 1 : kEstimatedRows;
  render_rows(coarser, coarse, row_step, rendered, monitor);
  const double scale = of_voxels ? kErrorsPerVoxelDifference : kErrorsPerRayDifference;
  ErrorEstimate error;
  error.relative = scale * relative_difference(rows_of(image, row_step), rows_of(rendered.beta0, row_step));
  if (plan.error.map) error.map = error_map(image, rendered.beta0, 0, scale);
  return error;
}

}  // namespace

struct VoxelEngine::State {
  State(const Scene& s, Volume volume, std::optional<Volume> twice_as_coarse) : scene(s, std::move(volume)) {
    if (twice_as_coarse && twice_as_coarse->n_occupied_voxels > 0) coarse.emplace(s, std::move(*twice_as_coarse));
  }

  VoxelScene scene;
  std::optional<VoxelScene> coarse;
  std::vector<std::string> warnings;
  double build_s = 0.0;
};

VoxelEngine::VoxelEngine(const Scene& scene, Volume volume, std::optional<Volume> coarse) {
  if (volume.n_occupied_voxels == 0 && !scene.ground) {
    throw GeometryError("the volume has no voxel with extinction or scattering, and there is no ground: "
                        "there is nothing to render");
  }
  const Stopwatch watch;
  state_ = std::make_unique<State>(scene, std::move(volume), std::move(coarse));
  state_->build_s = watch.seconds();
}

VoxelEngine::~VoxelEngine() = default;

const std::vector<std::string>& VoxelEngine::warnings() const { return state_->warnings; }
double VoxelEngine::build_s() const { return state_->build_s; }
std::uint64_t VoxelEngine::memory_bytes() const {
  return state_->scene.memory_bytes() + (state_->coarse ? state_->coarse->memory_bytes() : 0);
}

ViewPlan VoxelEngine::plan(const Acquisition& acquisition, const Sampling& sampling) const {
  ViewPlan plan = plan_voxel_view(state_->scene.planned(), state_->scene.volume, acquisition, sampling);
  // Each view copies the boxes of occupied voxels, relative to its aim point.
  plan.memory_bytes += state_->scene.boxes_m.size() * sizeof(Box);
  return plan;
}

RenderedView VoxelEngine::render(const ViewPlan& plan, const Monitor& monitor) const {
  const Stopwatch watch;
  const Acquisition& a = plan.acquisition;
  RenderedView out;
  out.beta0 = Image<float>(a.n_azimuth, a.n_range);
  out.layers = Layers(plan.layers.layers, a.n_azimuth, a.n_range);
  const Scene planned = state_->scene.planned();
  if (plan.fan.n_elevation == 0) {
    out.warnings.push_back(explain_blank(planned, plan, BlankEvidence{0, true}));
    return out;
  }

  render_rows(state_->scene, plan, 1, out, monitor);
  const std::string unknown = why_error_is_unknown(plan);
  if (plan.error.estimate && !unknown.empty()) {
    out.warnings.push_back("the error cannot be estimated: " + unknown);
  } else if (plan.error.estimate) {
    out.error = estimate(state_->coarse ? *state_->coarse : state_->scene, state_->coarse.has_value(), plan, out.beta0, monitor);
    if (plan.error.map) out.layers.error = std::move(out.error.map);
  }
  out.trace_and_deposit_s = watch.seconds();
  if (std::none_of(out.beta0.pixels().begin(), out.beta0.pixels().end(), [](float p) { return p > 0.0f; })) {
    out.warnings.push_back(explain_blank(planned, plan, BlankEvidence{out.n_hits, true}));
  }
  return out;
}

}  // namespace sarnerf
