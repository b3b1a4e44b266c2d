// SPDX-License-Identifier: Apache-2.0
#include "surface_view.h"

#include <algorithm>

namespace sarnerf {
namespace {

std::optional<GroundPlane> make_ground(const SurfaceScene& s, const ViewRays& rays, const Acquisition& a) {
  if (!s.scene.ground) return std::nullopt;
  return GroundPlane(rays, ground_of_view(ground_appearance(s.scene, s.origin_m), a, a.aim_m - s.origin_m),
                     s.scene.ground->height_m);
}

}  // namespace

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
      row_slices_(plan.acquisition, plan.n_sub_rows, scene.opaque.vertices_m, scene.origin_m - plan.acquisition.aim_m) {
  const Acquisition& a = plan.acquisition;
  if (!scene.media.empty()) media_extent_.emplace(a, scene.media.box_m());
  if (!plan.layers.layers.without(Layer::error).empty()) {
    layers_.emplace(a, plan.fan, plan.layers.reference_height_m);
    components_ = scene.components();
  }
  // β⁰ = (r_j Δθ / Δr) × sum over k, averaged over the row's slices.
  for (int j = 0; j < a.n_range; ++j) {
    beta0_per_mass_.push_back(plan.fan.step_rad / (a.range_spacing_m * plan.n_sub_rows) * a.range_m(j));
  }
}

SurfaceWorker SurfaceView::make_worker() const {
  SurfaceWorker w;
  if (layers_) w.layers.emplace(*layers_, plan_.layers.layers);
  if (nested_ != nullptr) w.nested.resize(nested_->n_levels());
  return w;
}

/// Deposits slice s of the row, in the image and where coarser samplings have it.
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

/// Bare ground to both sides of the rays that may meet the mesh.
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
  ground_->fill_alone(0, kept.count > 0 ? std::max(0, kept.first - 1) : n_el, slice);
  slice.scale(w.slices[s].weight);
  deposit(s, slice, w);
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

/// Slices [first, first + n) of the row.
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

}  // namespace sarnerf
