// SPDX-License-Identifier: Apache-2.0
#include "voxel/voxel_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sarnerf {

namespace {

/// Rays of each slice that are marched between two checks of the number of segments.
constexpr std::size_t kRaysPerStep = 16;

/// Embree's entry distances are in single precision: marching begins this much before them (voxels).
constexpr double kEntryMargin = 0.02;

/// Ground power below this fraction of the bare ground's is the rounding error of a fully hidden ground: set to 0.
constexpr double kGroundRounding = 1e-12;

/// Two-way optical depth that leaves half of the power. Behind a larger depth the reference plane counts as hidden.
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
    for (int k = 0; k < plan.fan.n_elevation; ++k) ground_->deposit(k, 0.0, plan.n_slices, bare_ground_);
  }
  if (!plan.layers.layers.without(Layer::error).empty()) layers_.emplace(a, plan.fan, plan.layers.reference_height_m);
  for (int j = 0; j < a.n_range; ++j) {
    beta0_per_mass_.push_back(beta0_per_contribution(a, plan.fan.step_rad, plan.n_slices, j));
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

/// Finds where the rays of a block of slices enter occupied voxels.
void VoxelView::trace(const Block& block, std::span<const RayRange> ranges, VoxelWorker& w) const {
  std::array<RayRow, RayTracer::kRowsPerBlock> rows;
  std::array<HitRow, RayTracer::kRowsPerBlock> hits;
  for (std::size_t s = 0; s < block.n_slices; ++s) {
    w.packed[s].pack(rays_, block.along_m[s], ranges);
    rows[s] = w.packed[s].rays(rays_.far_m);
    hits[s] = w.packed[s].hits();
  }
  scene_.tracer->entries(std::span(rows).first(block.n_slices), std::span(hits).first(block.n_slices));
}

/// Marches the slice's rays that entered occupied voxels.
void VoxelView::march(const Block& block, std::size_t slice, const Part& part, VoxelWorker& w) const {
  const PackedRow& packed = w.packed[slice];
  const double entry_margin_m = kEntryMargin * grid_.transform.voxel_size_m + scene_.slack_m;
  w.marched.clear();
  for (std::size_t n = part.first; n < part.end; ++n) {
    if (packed.box[n] == kNoTriangle) continue;
    const int k = w.packed_k[n];
    RangeInterval interval{rays_.start_offset_m + double(packed.distance[n]) - entry_margin_m,
                           rays_.start_offset_m + double(rays_.far_m)};
    if (ground_) interval.far_m = std::min(interval.far_m, ground_->offset_m(k));
    w.marched.push_back({block.along_m[slice], 0, k, interval, static_cast<int>(slice), static_cast<int>(n)});
  }
  w.depth.resize(w.marched.size());
  w.rows.march(w.marcher, rays_.grid, w.marched, w.depth);
  auto depth_of = w.depth.begin();
  for (std::size_t n = part.first; n < part.end; ++n) {
    const double depth = packed.box[n] != kNoTriangle ? *depth_of++ : 0.0;
    if (n < w.n_counted) continue;
    w.n_hits += depth > 0.0;
    if (ground_) see_ground(block, slice, w.packed_k[n], depth < kEndOfRayDepth ? std::exp(-depth) : 0.0, w);
  }
}

/// Marches the rays from `first` on, until all are done or, without layers, kMostSegments is reached.
VoxelView::Part VoxelView::march_part(const Block& block, std::size_t first, VoxelWorker& w) const {
  w.rows.clear();
  w.rows.begin_row(rays_.grid, block.row, plan_.n_slices);
  Part part{first, first};
  while (part.end < w.packed_k.size()) {
    if (!w.layers && part.end - first > 1 && w.rows.n_segments() >= kMostSegments) break;
    const Part step{part.end, std::min(part.end + kRaysPerStep, w.packed_k.size())};
    for (std::size_t s = 0; s < block.n_slices; ++s) march(block, s, step, w);
    part.end = step.end;
  }
  w.n_counted = part.end;
  return part;
}

/// Adds the ground seen by ray k, of which the fraction `passed` is visible, to the row's ground bins. For a uniform
/// ground, whose bare bins are there already, adds the hidden part with negative sign.
void VoxelView::see_ground(const Block& block, std::size_t slice, int k, double passed,
                           VoxelWorker& w) const {
  const double weight = uniform_ground_ ? passed - 1.0 : passed;
  if (weight == 0.0) return;
  ground_->deposit(k, block.along_m[slice], weight, w.ground_bins);
  if (w.layers) ground_->deposit(k, block.along_m[slice], weight, w.layers->ground[slice]);
}

/// Adds the ground of the rays outside `ranges`, which meet no occupied voxels, if the ground has no closed form.
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
  const BatchField& field = w.rows.field();
  const double forth = field.extinction_per_m[segment];
  return forth + (scene_.volume.channels.two_extinctions ? double(field.extinction_back_per_m[segment]) : forth);
}

bool VoxelView::plane_is_hidden(std::uint32_t ray, double plane_bin, const VoxelWorker& w) const {
  const SampleBatch& batch = w.rows.batch();
  double depth = 0.0;
  for (std::size_t q = batch.ray_begin[ray]; q < batch.ray_begin[ray + 1]; ++q) {
    const double before_m = (plane_bin - w.rows.field().near_bin[q]) * plan_.acquisition.range_spacing_m;
    if (before_m <= 0.0) break;
    depth += std::min(before_m, double(batch.length_m[q])) * two_way_per_m(w, q);
  }
  return depth > kHalfPower;
}

/// Makes the same deposit for layers, and marks the part of the reference plane that the slice hides.
void VoxelView::add_to_layers(std::size_t slice, VoxelWorker& w) const {
  const SampleBatch& batch = w.rows.batch();
  const FootprintDeposit& lattice = w.rows.lattice();
  VoxelWorker::LayerScratch& layers = *w.layers;
  for (std::size_t n = 0; n < w.packed_k.size(); ++n) {
    const std::uint32_t ray = lattice.ray(slice, n);
    if (ray == FootprintDeposit::kNoRay) continue;
    const int k = w.packed_k[n];
    const double plane_bin = layers_->plane_bin(k);
    if (std::isfinite(plane_bin) && plane_is_hidden(ray, plane_bin, w)) layers.row.hide_behind(k);
    // Segments of very small contribution, in front of and behind an opaque surface, do not count as scatterers.
    const double least = 0.1 * lattice.mass(slice, n) / static_cast<double>(batch.ray_begin[ray + 1] - batch.ray_begin[ray]);
    lattice.for_each_trapezoid(batch.ray_begin, slice, n, [&](std::size_t q, double c, double x0, double x1, double smear) {
      LayerRun run;
      run.component = layers.surface.component(batch.point_m[q]);
      run.mass = c;
      run.counts = c >= least;
      run.first_ray = run.last_ray = k;
      run.first_bin = x0;
      run.last_bin = x1;
      run.smear = smear;
      run.incidence_rad = layers.surface.incidence_rad(batch.point_m[q], batch.ray_direction[ray]);
      layers.row.add(run);
    });
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
  // Blocks of equal length: a last block of one slice would take nearly the time of a full one.
  const int n_blocks = (plan_.n_slices + plan_.n_slices_at_once - 1) / plan_.n_slices_at_once;
  const int n_at_once = (plan_.n_slices + n_blocks - 1) / n_blocks;
  for (int first = 0; first < plan_.n_slices; first += n_at_once) {
    monitor.check();
    Block block;
    block.row = i;
    block.n_slices = static_cast<std::size_t>(std::min(n_at_once, plan_.n_slices - first));
    w.rows.begin_lattice(block.n_slices, w.consecutive);
    for (std::size_t s = 0; s < block.n_slices; ++s) {
      block.along_m[s] = slice_along_m(a, i, first + static_cast<int>(s), plan_.n_slices);
      if (w.layers) {
        w.layers->ground[s] = bare_ground_;
        for (double& mass : w.layers->ground[s]) mass /= plan_.n_slices;
      }
      if (ground_ && !uniform_ground_) see_bare_ground(block, s, ranges, w);
    }
    if (!w.packed_k.empty()) trace(block, ranges, w);
    w.n_counted = 0;
    for (Part part{0, 0}; part.first < w.packed_k.size(); part.first = part.end) {
      part = march_part(block, part.first, w);
      w.rows.emit(scene_.volume.channels.basis, plan_.integrator, part.first, part.end);
      // A ray's footprint needs the next ray: the last ray of a part is marched again with the next part.
      if (part.end < w.packed_k.size()) --part.end;
      for (std::size_t s = 0; s < block.n_slices; ++s) w.rows.deposit(s, part.first, part.end, w.bins);
    }
    for (std::size_t s = 0; s < block.n_slices && w.layers; ++s) {
      w.layers->row.begin_slice();
      for (std::size_t j = 0; j < w.bins.size(); ++j) {
        double& mass = w.layers->ground[s][j];
        if (!(mass > kGroundRounding * bare_ground_[j])) mass = 0.0;
      }
      w.layers->row.add_ground(w.layers->ground[s]);
      add_to_layers(s, w);
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
