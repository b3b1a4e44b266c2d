// SPDX-License-Identifier: Apache-2.0
#include "voxel/voxel_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deposit.h"

namespace sarnerf {

namespace {

/// Rays of each slice that are marched before the segments are counted.
constexpr std::size_t kRaysPerStep = 16;

/// Segments that emit less than this part of what lies before them on their ray are left out.
constexpr double kLeastPart = 1e-7;

/// Embree's entries are in single precision: begin a little before them (voxels).
constexpr double kEntryMargin = 0.02;

/// What of the ground all rays together hide is hidden but for rounding.
constexpr double kGroundRounding = 1e-12;

/// Two-way optical depth that leaves half of the power: behind more, the reference plane counts as hidden.
constexpr double kHalfPower = std::numbers::ln2;

Box visible_box(const VoxelScene& scene, const Acquisition& a) {
  return scene.volume.support_m.empty() ? Box{a.aim_m, a.aim_m} : scene.volume.support_m;
}

}  // namespace

VoxelView::VoxelView(const VoxelScene& scene, const ViewPlan& plan)
    : scene_(scene),
      plan_(plan),
      box_m_(visible_box(scene, plan.acquisition)),
      visible_(plan.acquisition, plan.fan, scene.boxes_from(plan.acquisition.aim_m)),
      rays_(plan.acquisition, plan.fan, scene.origin_m,
            VisibleExtent(plan.acquisition, box_m_).range_offsets_m()),
      grid_(scene.volume.grid.view()) {
  const Acquisition& a = plan.acquisition;
  grid_.transform.origin_m -= a.aim_m;
  bare_ground_.assign(static_cast<std::size_t>(a.n_range), 0.0);
  if (scene.ground) {
    ground_.emplace(rays_, ground_of_view(*scene.ground, a, a.aim_m - scene.origin_m),
                    scene.scene.ground->height_m);
    uniform_ground_ = ground_->uniform();
  }
  if (uniform_ground_) {
    for (int k = 0; k < plan.fan.n_elevation; ++k) ground_->deposit(k, 0.0, plan.n_sub_rows, bare_ground_);
  }
  if (!plan.layers.layers.without(Layer::error).empty()) layers_.emplace(a, plan.fan, plan.layers.reference_height_m);
  for (int j = 0; j < a.n_range; ++j) {
    beta0_per_mass_.push_back(plan.fan.step_rad / (a.range_spacing_m * plan.n_sub_rows) * a.range_m(j));
  }
}

VoxelWorker VoxelView::make_worker() const {
  VoxelWorker w(grid_, scene_, scene_.volume.longest_segment * grid_.transform.voxel_size_m);
  if (layers_) {
    w.layers.emplace(VoxelWorker::LayerScratch{LayerRow(*layers_, plan_.layers.layers),
                                               VolumeSurface(scene_.volume, grid_), {}});
  }
  return w;
}

/// Finds where the rays of a block of slices enter matter.
void VoxelView::trace(const Block& block, std::span<const RayRange> ranges, VoxelWorker& w) const {
  std::array<RayRow, RayTracer::kRowsPerBlock> rows;
  std::array<HitRow, RayTracer::kRowsPerBlock> hits;
  for (std::size_t s = 0; s < block.n_slices; ++s) {
    w.rows[s].pack(rays_, block.along_m[s], ranges);
    rows[s] = w.rows[s].rays(rays_.far_m);
    hits[s] = w.rows[s].hits();
  }
  scene_.tracer->entries(std::span(rows).first(block.n_slices), std::span(hits).first(block.n_slices));
}

/// Marches those of the slice's rays that entered matter.
void VoxelView::march(const Block& block, std::size_t slice, const Part& part, VoxelWorker& w) const {
  const PackedRow& packed = w.rows[slice];
  SliceEmission& emission = w.emission[slice];
  const double entry_margin_m = kEntryMargin * grid_.transform.voxel_size_m + scene_.slack_m;
  w.marched.clear();
  for (std::size_t n = part.first; n < part.end; ++n) {
    if (packed.box[n] == kNoTriangle) continue;
    const int k = w.packed_k[n];
    RangeInterval interval{rays_.start_offset_m + double(packed.distance[n]) - entry_margin_m,
                           rays_.start_offset_m + double(rays_.far_m)};
    if (ground_) interval.far_m = std::min(interval.far_m, ground_->offset_m(k));
    emission.batch_ray[n] = static_cast<std::uint32_t>(w.batch.n_rays() + w.marched.size());
    w.marched.push_back({block.along_m[slice], 0, k, interval});
  }
  w.depth.resize(w.marched.size());
  w.marcher.march(rays_.grid, w.marched, w.batch, w.field, w.depth);
  auto depth_of = w.depth.begin();
  for (std::size_t n = part.first; n < part.end; ++n) {
    const double depth = packed.box[n] != kNoTriangle ? *depth_of++ : 0.0;
    if (n < w.n_counted) continue;
    w.n_hits += depth > 0.0;
    if (ground_) see_ground(block, slice, w.packed_k[n], depth < kEndOfRayDepth ? std::exp(-depth) : 0.0, w);
  }
}

/// Marches the rays from `first` on, until all are done or their segments fill the worker's memory.
VoxelView::Part VoxelView::march_part(const Block& block, std::size_t first, VoxelWorker& w) const {
  w.batch.clear();
  w.field.clear();
  Part part{first, first};
  while (part.end < w.packed_k.size()) {
    if (!w.layers && part.end - first > 1 && w.batch.n_segments() >= kMostSegments) break;
    const Part step{part.end, std::min(part.end + kRaysPerStep, w.packed_k.size())};
    for (std::size_t s = 0; s < block.n_slices; ++s) march(block, s, step, w);
    part.end = step.end;
  }
  w.n_counted = part.end;
  return part;
}

/// What ray k sees of the ground goes into the row's ground: all of it, or, where the bare ground is known,
/// what is missing of it.
void VoxelView::see_ground(const Block& block, std::size_t slice, int k, double passed,
                           VoxelWorker& w) const {
  const double weight = uniform_ground_ ? passed - 1.0 : passed;
  if (weight == 0.0) return;
  ground_->deposit(k, block.along_m[slice], weight, w.ground_bins);
  if (w.layers) ground_->deposit(k, block.along_m[slice], weight, w.layers->ground[slice]);
}

/// The ground between rays that may meet matter, where it is not known in closed form.
void VoxelView::see_bare_ground(const Block& block, std::size_t slice, std::span<const RayRange> ranges,
                                VoxelWorker& w) const {
  int k = 0;
  for (const RayRange& range : ranges) {
    for (; k < range.first; ++k) see_ground(block, slice, k, 1.0, w);
    k = range.first + range.count;
  }
  for (; k < plan_.fan.n_elevation; ++k) see_ground(block, slice, k, 1.0, w);
}

double VoxelView::two_way_per_m(const VoxelWorker& w, std::size_t segment) const {
  const double forth = w.field.extinction_per_m[segment];
  return forth + (scene_.volume.channels.two_extinctions ? double(w.field.extinction_back_per_m[segment]) : forth);
}

SegmentEmission VoxelView::emission_of_segment(const VoxelWorker& w, std::size_t segment) const {
  const double length_m = w.batch.length_m[segment];
  return segment_emission(w.field.near_bin[segment], length_m / plan_.acquisition.range_spacing_m,
                          length_m * two_way_per_m(w, segment));
}

/// What each ray of the part emits, and where.
void VoxelView::find_emissions(const Block& block, const Part& part, VoxelWorker& w) const {
  w.contributions.resize(w.batch.n_segments());
  w.emitted.resize(w.batch.n_segments());
  contributions(spans(w.batch), samples(w.field, scene_.volume.channels.basis), plan_.integrator,
                w.contributions);
  for (std::size_t s = 0; s < block.n_slices; ++s) {
    SliceEmission& emission = w.emission[s];
    for (std::size_t n = part.first; n < part.end; ++n) {
      const std::uint32_t ray = emission.batch_ray[n];
      if (ray == SliceEmission::kNoRay) continue;
      double mass = 0.0, moment = 0.0;
      for (std::size_t q = w.batch.ray_begin[ray]; q < w.batch.ray_begin[ray + 1]; ++q) {
        const double c = w.contributions[q];
        if (!(c > kLeastPart * mass)) continue;
        w.emitted[q] = emission_of_segment(w, q);
        mass += c;
        moment += c * w.emitted[q].bin;
      }
      emission.mass[n] = mass;
      emission.centroid[n] = mass > 0.0 ? moment / mass : 0.0;
    }
  }
}

/// Places what a slice emits on the row's bins.
void VoxelView::deposit(std::size_t slice, const Part& part, const Footprints& footprints,
                        VoxelWorker& w) const {
  const SliceEmission& emission = w.emission[slice];
  for (std::size_t n = part.first; n < part.end; ++n) {
    if (!(emission.mass[n] > 0.0)) continue;
    const RangeSpan over_ray = footprints.over_ray(slice, n);
    const double over_slice = footprints.over_slice(slice, n);
    const std::uint32_t ray = emission.batch_ray[n];
    double mass = 0.0;
    for (std::size_t q = w.batch.ray_begin[ray]; q < w.batch.ray_begin[ray + 1]; ++q) {
      const double c = w.contributions[q];
      if (!(c > kLeastPart * mass)) continue;
      mass += c;
      const SegmentEmission& at = w.emitted[q];
      deposit_trapezoid(w.bins, at.bin + over_ray.first, at.bin + over_ray.last, over_slice + at.width, c);
    }
  }
}

bool VoxelView::plane_is_hidden(std::uint32_t ray, double plane_bin, const VoxelWorker& w) const {
  double depth = 0.0;
  for (std::size_t q = w.batch.ray_begin[ray]; q < w.batch.ray_begin[ray + 1]; ++q) {
    const double before_m = (plane_bin - w.field.near_bin[q]) * plan_.acquisition.range_spacing_m;
    if (before_m <= 0.0) break;
    depth += std::min(before_m, double(w.batch.length_m[q])) * two_way_per_m(w, q);
  }
  return depth > kHalfPower;
}

/// The same as deposit() for layers, and which part of the reference plane the slice hides.
void VoxelView::add_to_layers(std::size_t slice, const Footprints& footprints, VoxelWorker& w) const {
  const SliceEmission& emission = w.emission[slice];
  VoxelWorker::LayerScratch& layers = *w.layers;
  for (std::size_t n = 0; n < w.packed_k.size(); ++n) {
    const std::uint32_t ray = emission.batch_ray[n];
    if (ray == SliceEmission::kNoRay) continue;
    const int k = w.packed_k[n];
    const double plane_bin = layers_->plane_bin(k);
    if (std::isfinite(plane_bin) && plane_is_hidden(ray, plane_bin, w)) layers.row.hide_behind(k);
    if (!(emission.mass[n] > 0.0)) continue;
    const RangeSpan over_ray = footprints.over_ray(slice, n);
    const double over_slice = footprints.over_slice(slice, n);
    const std::size_t begin = w.batch.ray_begin[ray], end = w.batch.ray_begin[ray + 1];
    // Segments that give next to nothing, before and behind an opaque surface, are no scatterers of their own.
    const double least = 0.1 * emission.mass[n] / static_cast<double>(end - begin);
    double mass = 0.0;
    for (std::size_t q = begin; q < end; ++q) {
      const double c = w.contributions[q];
      if (!(c > kLeastPart * mass)) continue;
      mass += c;
      const SegmentEmission& at = w.emitted[q];
      LayerRun run;
      run.component = layers.surface.component(w.batch.point_m[q]);
      run.mass = c;
      run.counts = c >= least;
      run.first_ray = run.last_ray = k;
      run.first_bin = at.bin + over_ray.first;
      run.last_bin = at.bin + over_ray.last;
      run.smear = over_slice + at.width;
      run.incidence_rad = layers.surface.incidence_rad(w.batch.point_m[q], w.batch.ray_direction[ray]);
      layers.row.add(run);
    }
  }
}

void VoxelView::render_row(int i, VoxelWorker& w, RenderedView& out, const Monitor& monitor) const {
  const Acquisition& a = plan_.acquisition;
  w.bins.assign(static_cast<std::size_t>(a.n_range), 0.0);
  w.ground_bins = bare_ground_;
  if (w.layers) w.layers->row.begin_row();
  const std::span<const RayRange> ranges = visible_.row(i);
  w.packed_k.clear();
  w.consecutive.clear();
  for (const RayRange& range : ranges) {
    for (int k = range.first; k < range.first + range.count; ++k) {
      w.packed_k.push_back(k);
      w.consecutive.push_back(k + 1 < range.first + range.count);
    }
  }
  const double slice_width_m = a.azimuth_spacing_m / plan_.n_sub_rows;
  const double first_along_m = a.row_offset_m(static_cast<double>(i) - 0.5) + 0.5 * slice_width_m;
  const int n_at_once = plan_.n_slices_at_once;
  for (int first = 0; first < plan_.n_sub_rows; first += n_at_once) {
    monitor.check();
    Block block;
    block.n_slices = static_cast<std::size_t>(std::min(n_at_once, plan_.n_sub_rows - first));
    for (std::size_t s = 0; s < block.n_slices; ++s) {
      block.along_m[s] = first_along_m + (first + static_cast<int>(s)) * slice_width_m;
      w.emission[s].assign(w.packed_k.size());
      if (w.layers) {
        w.layers->ground[s] = bare_ground_;
        for (double& mass : w.layers->ground[s]) mass /= plan_.n_sub_rows;
      }
      if (ground_ && !uniform_ground_) see_bare_ground(block, s, ranges, w);
    }
    if (!w.packed_k.empty()) trace(block, ranges, w);
    const Footprints footprints(std::span(w.emission).first(block.n_slices), w.consecutive);
    w.n_counted = 0;
    for (Part part{0, 0}; part.first < w.packed_k.size(); part.first = part.end) {
      part = march_part(block, part.first, w);
      find_emissions(block, part, w);
      // A ray's footprint needs its neighbour behind: the last one comes again with the next part.
      if (part.end < w.packed_k.size()) --part.end;
      for (std::size_t s = 0; s < block.n_slices; ++s) deposit(s, part, footprints, w);
    }
    for (std::size_t s = 0; s < block.n_slices && w.layers; ++s) {
      w.layers->row.begin_slice();
      for (std::size_t j = 0; j < w.bins.size(); ++j) {
        double& mass = w.layers->ground[s][j];
        if (!(mass > kGroundRounding * bare_ground_[j])) mass = 0.0;
      }
      w.layers->row.add_ground(w.layers->ground[s]);
      add_to_layers(s, footprints, w);
      w.layers->row.end_slice();
    }
  }
  const auto row = out.beta0.row(i);
  for (std::size_t j = 0; j < row.size(); ++j) {
    const double ground_seen = w.ground_bins[j] > kGroundRounding * bare_ground_[j] ? w.ground_bins[j] : 0.0;
    row[j] = static_cast<float>((w.bins[j] + ground_seen) * beta0_per_mass_[j]);
  }
  if (w.layers) w.layers->row.end_row(i, beta0_per_mass_, out.layers);
}

}  // namespace sarnerf
