// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <optional>
#include <span>
#include <vector>

#include "error_estimate.h"
#include "layers/layer_row.h"
#include "plan.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/render/engine.h"
#include "surface/reconstruct.h"
#include "surface/row_slices.h"
#include "surface/surface_scene.h"

namespace sarnerf {

namespace {

/// Scratch of one worker that renders rows of a mesh.
struct SurfaceWorker {
  SliceBlock block;
  Slice bare;  ///< slice that meets the ground only
  MediaScratch media;
  std::vector<RowSlice> slices;    ///< of the row under way
  std::vector<SliceGroup> groups;  ///< their groups in the coarser samplings
  std::vector<double> bins, ground_bins;
  std::optional<LayerRow> layers;
  std::uint64_t n_hits = 0;

  /// One coarser sampling of the row.
  struct Nested {
    std::vector<double> bins;
    SliceSubset subset;
    MediaScratch media;
  };
  std::vector<Nested> nested;  ///< one for each level
  std::vector<MediaSubset> media_subsets;
};

/// One view of a mesh, row by row; rows are independent.
class SurfaceView {
 public:
  /// `scene`, `plan` and `nested` must outlive it; the plan has at least one ray. `nested`, unless null, receives
  /// the coarser samplings.
  SurfaceView(const SurfaceScene& scene, const ViewPlan& plan, NestedImages* nested);

  SurfaceWorker make_worker() const;

  /// Writes row i of the image, of the layers that the plan asks for, and of the nested images.
  void render_row(int i, SurfaceWorker& w, RenderedView& out, const Monitor& monitor) const;

 private:
  void render_slices(std::size_t first, std::size_t n, SurfaceWorker& w) const;
  void render_kept(std::size_t s, const RayRange& kept, const RayRange& through_media, Slice& slice,
                   SurfaceWorker& w) const;
  void render_ground_around(std::size_t s, const RayRange& kept, const Slice& beside, SurfaceWorker& w) const;
  void deposit(std::size_t s, const Slice& slice, SurfaceWorker& w) const;
  void deposit_ground_outside(std::size_t s, double gap_first, double gap_last, SurfaceWorker& w) const;

  /// Calls f(k_step, group, the worker's scratch) for the coarser samplings that slice s of the row is part of.
  template <class F>
  void for_nested(std::size_t s, SurfaceWorker& w, F&& f) const {
    if (w.groups[s].n_slices == 0) return;
    for (std::size_t l = 0; l < w.nested.size(); ++l) f(NestedImages::k_step(l), w.groups[s], w.nested[l]);
  }

  const SurfaceScene& scene_;
  const ViewPlan& plan_;
  NestedImages* nested_;
  VisibleExtent extent_;
  ViewRays rays_;
  TriangleSections sections_;
  std::optional<GroundPlane> ground_;
  SliceScene slice_scene_;
  std::optional<VisibleExtent> media_extent_;
  std::optional<LayerView> layers_;
  std::span<const Component> components_;
  RowSlices row_slices_;
  std::vector<double> beta0_per_mass_;  ///< (r_j Δθ / Δr), averaged over the row's slices
};

std::optional<GroundPlane> make_ground(const SurfaceScene& s, const ViewRays& rays, const Acquisition& a) {
  if (!s.scene.ground) return std::nullopt;
  return GroundPlane(rays, ground_of_view(ground_appearance(s.scene, s.origin_m), a, a.aim_m - s.origin_m),
                     s.scene.ground->height_m);
}

SurfaceView::SurfaceView(const SurfaceScene& scene, const ViewPlan& plan, NestedImages* nested)
    : scene_(scene),
      plan_(plan),
      nested_(nested),
      extent_(plan.acquisition,
              scene.scene.box.empty() ? Box{plan.acquisition.aim_m, plan.acquisition.aim_m} : scene.scene.box),
      rays_(plan.acquisition, plan.fan, scene.origin_m, extent_.range_offsets_m()),
      sections_(rays_, vertices(scene.opaque.vertices_m), scene.opaque.triangles, scene.origin_m),
      ground_(make_ground(scene, rays_, plan.acquisition)),
      slice_scene_{rays_, sections_, scene.appearances, ground_ ? &ground_->appearance() : nullptr},
      row_slices_(plan.acquisition, plan.n_slices, scene.opaque.vertices_m, scene.origin_m - plan.acquisition.aim_m) {
  const Acquisition& a = plan.acquisition;
  if (!scene.media.empty()) media_extent_.emplace(a, scene.media.box_m());
  if (!plan.layers.layers.without(Layer::error).empty()) {
    layers_.emplace(a, plan.fan, plan.layers.reference_height_m);
    components_ = scene.components();
  }
  // β⁰ = (r_j Δθ / Δr) × sum over k, averaged over the row's slices.
  for (int j = 0; j < a.n_range; ++j) {
    beta0_per_mass_.push_back(beta0_per_contribution(a, plan.fan.step_rad, plan.n_slices, j));
  }
}

SurfaceWorker SurfaceView::make_worker() const {
  SurfaceWorker w;
  if (layers_) w.layers.emplace(*layers_, plan_.layers.layers);
  if (nested_ != nullptr) w.nested.resize(nested_->n_levels());
  return w;
}

/// Deposits slice s of the row in the image and in the coarser samplings that contain it.
void SurfaceView::deposit(std::size_t s, const Slice& slice, SurfaceWorker& w) const {
  deposit_slice(slice, slice_scene_, w.bins, LayerSink{w.layers ? &*w.layers : nullptr, components_});
  for_nested(s, w, [&](int k_step, const SliceGroup& group, SurfaceWorker::Nested& n) {
    n.subset.take(slice, k_step, group);
    for (const Slice* part : {&n.subset.steps, &n.subset.rest}) {
      if (part->n_rays >= 0) deposit_slice(*part, slice_scene_, n.bins);
    }
  });
}

void SurfaceView::deposit_ground_outside(std::size_t s, double gap_first, double gap_last,
                                         SurfaceWorker& w) const {
  const double weight = w.slices[s].weight;
  ground_->deposit_outside(gap_first, gap_last, weight, w.bins);
  if (w.layers) {
    w.ground_bins.assign(w.bins.size(), 0.0);
    ground_->deposit_outside(gap_first, gap_last, weight, w.ground_bins);
    w.layers->add_ground(w.ground_bins);
  }
  for_nested(s, w, [&](int, const SliceGroup& group, SurfaceWorker::Nested& n) {
    ground_->deposit_outside(gap_first, gap_last, weight * group.n_slices, n.bins);
  });
}

/// Deposits the bare ground on both sides of the rays that may meet the mesh.
void SurfaceView::render_ground_around(std::size_t s, const RayRange& kept, const Slice& beside,
                                       SurfaceWorker& w) const {
  const int n_el = plan_.fan.n_elevation, end = kept.first + kept.count;
  if (ground_->uniform()) {
    deposit_ground_outside(s, kept.first - 1, kept.count > 0 ? end : -2, w);
    return;
  }
  Slice& slice = w.bare;
  slice.along_m = beside.along_m;
  slice.width_m = beside.width_m;
  // The kept rays' own slice begins with the ray before them, and ends with the one after them.
  if (kept.count == 0 || kept.first > 0) {
    ground_->fill_alone(0, kept.count > 0 ? kept.first - 1 : n_el, slice);
    slice.scale(w.slices[s].weight);
    deposit(s, slice, w);
  }
  if (kept.count == 0 || end >= n_el) return;
  ground_->fill_alone(end + 1, std::max(0, n_el - end - 1), slice);
  slice.scale(w.slices[s].weight);
  deposit(s, slice, w);
}

void SurfaceView::render_kept(std::size_t s, const RayRange& kept, const RayRange& through_media, Slice& slice,
                              SurfaceWorker& w) const {
  if (ground_) {
    ground_->fill(slice);
  } else {
    slice.surface.front() = kNoTriangle;
    slice.surface[static_cast<std::size_t>(kept.count) + 1] = kNoTriangle;
  }
  slice.scale(w.slices[s].weight);
  if (through_media.count > 0) {
    w.media_subsets.clear();
    for_nested(s, w, [&](int k_step, const SliceGroup& group, SurfaceWorker::Nested& n) {
      w.media_subsets.push_back({k_step, group, &n.media, n.bins});
    });
    scene_.media.apply(rays_, plan_.integrator, through_media.first, through_media.first + through_media.count,
                       w.slices[s].weight, slice, w.media, w.bins, w.layers ? &*w.layers : nullptr,
                       w.media_subsets);
  }
  deposit(s, slice, w);
}

/// Renders slices [first, first + n) of the row.
void SurfaceView::render_slices(std::size_t first, std::size_t n, SurfaceWorker& w) const {
  SliceBlock& block = w.block;
  block.n_slices = n;
  for (std::size_t s = 0; s < n; ++s) {
    block.slices[s].along_m = w.slices[first + s].along_m;
    block.slices[s].width_m = w.slices[first + s].width_m;
  }
  std::optional<std::pair<double, double>> angles;
  const double first_along_m = w.slices[first].along_m, last_along_m = w.slices[first + n - 1].along_m;
  if (!scene_.scene.box.empty()) angles = extent_.angles(first_along_m, last_along_m);
  const RayRange kept = rays_inside(plan_.fan, angles);
  if (kept.count > 0) {
    w.n_hits += trace_slices(*scene_.tracer, rays_, scene_.appearances, kept.first, kept.count, block);
  }
  RayRange through_media;
  if (media_extent_) {
    through_media = rays_inside(plan_.fan, media_extent_->angles(first_along_m, last_along_m));
  }
  for (std::size_t s = 0; s < n; ++s) {
    if (w.layers) w.layers->begin_slice();
    if (ground_) render_ground_around(first + s, kept, block.slices[s], w);
    if (kept.count > 0) render_kept(first + s, kept, through_media, block.slices[s], w);
    if (w.layers) w.layers->end_slice();
  }
}

void SurfaceView::render_row(int i, SurfaceWorker& w, RenderedView& out, const Monitor& monitor) const {
  const Acquisition& a = plan_.acquisition;
  w.bins.assign(static_cast<std::size_t>(a.n_range), 0.0);
  for (SurfaceWorker::Nested& n : w.nested) n.bins.assign(w.bins.size(), 0.0);
  if (w.layers) w.layers->begin_row();
  row_slices_.row(i, w.slices, w.groups);
  if (nested_ != nullptr && nested_->next_row()) w.groups.front() = {1, 1.0};
  const auto n_at_once = static_cast<std::size_t>(plan_.n_slices_at_once);
  for (std::size_t s = 0; s < w.slices.size(); s += n_at_once) {
    monitor.check();  // a row may have thousands of slices
    render_slices(s, std::min(n_at_once, w.slices.size() - s), w);
  }
  const auto row = out.beta0.row(i);
  for (std::size_t j = 0; j < row.size(); ++j) row[j] = static_cast<float>(w.bins[j] * beta0_per_mass_[j]);
  if (w.layers) w.layers->end_row(i, beta0_per_mass_, out.layers);
  for (std::size_t l = 0; l < w.nested.size(); ++l) nested_->end_row(i, l, w.nested[l].bins, beta0_per_mass_);
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
  const Stopwatch watch;
  state_ = std::make_unique<State>(scene);
  state_->build_s = watch.seconds();
}

SurfaceEngine::~SurfaceEngine() = default;

const std::vector<std::string>& SurfaceEngine::warnings() const { return state_->scene.warnings; }
double SurfaceEngine::build_s() const { return state_->build_s; }
std::uint64_t SurfaceEngine::memory_bytes() const { return state_->scene.memory_bytes(); }

ViewPlan SurfaceEngine::plan(const Acquisition& acquisition, const Sampling& sampling) const {
  return plan_view(state_->scene.scene, state_->scene.media.box_m(), acquisition, sampling);
}

RenderedView SurfaceEngine::render(const ViewPlan& plan, const Monitor& monitor) const {
  const Stopwatch watch;
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
      // Only one worker reports progress: reports must not overlap.
      const std::size_t done = ++n_rows_done;
      if (worker == 0) monitor.report("rendering rows", done, static_cast<std::uint64_t>(a.n_azimuth));
    }
  });

  for (const SurfaceWorker& w : workers) out.n_hits += w.n_hits;
  if (nested) out.error = nested->estimate(out.beta0);
  if (nested && plan.error.map) out.layers.error = std::move(out.error.map);
  if (plan.error.estimate && !unknown.empty()) out.warnings.push_back("the error cannot be estimated: " + unknown);
  out.trace_and_deposit_s = watch.seconds();
  if (std::none_of(out.beta0.pixels().begin(), out.beta0.pixels().end(), [](float p) { return p > 0.0f; })) {
    out.warnings.push_back(explain_blank(state_->scene.scene, plan, BlankEvidence{out.n_hits}));
  }
  return out;
}

}  // namespace sarnerf
