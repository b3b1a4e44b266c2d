// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sarnerf/mpa/volume_march.h"
#include "surface/surface_scene.h"

namespace sarnerf {

namespace {

/// Offsets of the sub-rays of one ray within its cell (one step of k by one slice width): a rank-1 lattice.
struct CellOffset {
  double ray, slice;
};
CellOffset cell_offset(int q, int count) {
  constexpr double kGolden = 0.6180339887498949;
  const double slice = (q + 0.5) * kGolden;
  return {(q + 0.5) / count - 0.5, slice - std::floor(slice) - 0.5};
}

constexpr int kMaxSubRays = 64;

/// Segments are integrated in batches of about this many, which bounds the memory of a worker.
constexpr std::size_t kMostSegments = std::size_t{1} << 16;

/// Two-way optical depth that leaves half of the power.
constexpr double kHalfPower = std::numbers::ln2;

/// Adds the contribution of each segment of the scratch to the layers.
void add_layers(const MediaScratch& scratch, LayerRow& layers) {
  for (std::size_t ray = 0; ray < scratch.ray_k.size(); ++ray) {
    LayerRun run;
    run.first_ray = scratch.ray_k[ray] - 0.5;
    run.last_ray = scratch.ray_k[ray] + 0.5;
    for (std::uint32_t q = scratch.ray_begin[ray]; q < scratch.ray_begin[ray + 1]; ++q) {
      if (scratch.bin[q] == kNoBin) continue;
      run.mass = scratch.contributions[q];
      run.first_bin = run.last_bin = scratch.bin[q] + 0.5;
      layers.add(run);
    }
  }
}

}  // namespace

void MediaScratch::clear() {
  ray_begin.assign(1, 0);
  ray_row.clear();
  ray_k.clear();
  bin.clear();
  for (auto* array : {&length_m, &extinction, &extinction_back, &scattering}) array->clear();
}

Media::Media(const Scene& scene, const glm::dvec3& scene_origin_m) {
  std::vector<std::uint32_t> chosen;
  std::vector<std::uint16_t> medium_of_material(scene.materials.size(), 0);
  for (std::size_t n = 0; n < scene.materials.size(); ++n) {
    if (scene.materials[n].opaque) continue;
    medium_of_material[n] = static_cast<std::uint16_t>(media_.size());
    media_.push_back(scene.materials[n]);
    two_way_equal_ &= media_.back().extinction_per_m == media_.back().extinction_back_per_m;
  }
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (!scene.materials[scene.mesh.material[t]].opaque && scene.pieces[scene.mesh.piece[t]].closed) {
      chosen.push_back(t);
    }
  }
  if (chosen.empty()) return;
  TriangleSubset subset = take_triangles(scene.mesh, chosen, scene_origin_m);
  vertices_m_ = std::move(subset.vertices_m);
  triangles_ = std::move(subset.triangles);
  for (const std::uint32_t t : chosen) {
    piece_.push_back(scene.mesh.piece[t]);
    medium_.push_back(medium_of_material[scene.mesh.material[t]]);
  }
  for (const glm::uvec3& corners : triangles_) {
    for (int c = 0; c < 3; ++c) {
      box_.include(glm::dvec3(vertices_m_[corners[c]]) + scene_origin_m);
    }
  }
  tracer_ = std::make_unique<RayTracer>(vertices(vertices_m_), triangles_);
}

void Media::find_boundaries(const ViewRays& rays, const Slice& slice, int k,
                            MediaScratch& scratch) const {
  std::vector<MediaBoundary>& boundaries = scratch.boundaries;
  boundaries.clear();
  const auto n_ray = static_cast<std::size_t>(k);
  const Acquisition& a = rays.grid.acquisition();
  const glm::dvec3 h = rays.grid.frame().h, d = rays.grid.direction(k);
  const glm::dvec3 turn(rays.turn_x[n_ray], rays.turn_y[n_ray], rays.turn_z[n_ray]);
  const glm::vec3 origin(rays.scene_point(slice.along_m, rays.start_offset_m, k));
  tracer_->all_hits(origin, glm::vec3(d), rays.far_m, scratch.crossings);

  const auto depth_in = [&](std::uint32_t piece) {
    double depth = 0.0;
    for (const MediaBoundary& b : boundaries) depth += b.piece == piece ? b.sign : 0.0;
    return depth;
  };
  for (const Crossing& crossing : scratch.crossings) {
    const glm::dvec3 n(crossing.normal);
    const double along_d = glm::dot(n, d);
    const double sign = along_d < 0.0 ? 1.0 : -1.0;
    const std::uint32_t piece = piece_[crossing.triangle];
    // A ray through an edge meets both faces: entering twice, or leaving a piece that it did not enter, is
    // one crossing counted twice.
    if ((sign > 0.0) == (depth_in(piece) > 0.0)) continue;
    const double offset_m = rays.start_offset_m + crossing.distance_m;
    const double steepest = std::copysign(std::max(std::abs(along_d), 1e-3 * glm::length(n)), along_d);
    const double bins_per_plane = 1.0 / (steepest * a.range_spacing_m);
    boundaries.push_back({rays.bin_coordinate(offset_m),
                          -(a.slant_range_m + offset_m) * rays.grid.fan().step_rad *
                              glm::dot(n, turn) * bins_per_plane,
                          -slice.width_m * glm::dot(n, h) * bins_per_plane, sign, piece,
                          medium_[crossing.triangle]});
  }
  // A solid that the ray enters and never leaves was grazed at an edge: it has no length. A piece is left
  // before it is entered again, so that an unmatched entry is the piece's last boundary.
  for (std::size_t n = boundaries.size(); n-- > 0;) {
    const MediaBoundary b = boundaries[n];
    if (b.sign > 0.0 && depth_in(b.piece) > 0.0) {
      boundaries.erase(boundaries.begin() + static_cast<std::ptrdiff_t>(n));
    }
  }
}

double Media::depth_before(double bin, double spacing_m,
                           std::span<const MediaBoundary> boundaries) const {
  double depth = 0.0;
  for (const MediaBoundary& b : boundaries) {
    const Material& medium = media_[b.medium];
    const double two_way = medium.extinction_per_m + medium.extinction_back_per_m;
    depth -= b.sign * two_way * spacing_m * std::min(b.bin, bin);
  }
  return std::max(0.0, depth);
}

void Media::append_ray(const Cell& cell, double spacing_m, double end_of_ray, double n_bins, int k,
                       std::span<const MediaBoundary> boundaries, MediaScratch& scratch) const {
  double steepest_bins = 0.0, densest_per_m = 0.0;
  for (const MediaBoundary& b : boundaries) {
    steepest_bins = std::max(steepest_bins, cell.rays * std::abs(b.bin_per_ray) +
                                                cell.slices * std::abs(b.bin_per_slice));
    const Material& medium = media_[b.medium];
    densest_per_m = std::max(densest_per_m, medium.extinction_per_m + medium.extinction_back_per_m);
  }
  // A dense medium scatters at its surface, whose range must be spread over the cell as finely as that of an
  // opaque face. A thin medium spreads its power in range by itself.
  const double cells = densest_per_m * spacing_m > 0.05 ? 4.0 * steepest_bins : steepest_bins;
  const int n_sub_rays = static_cast<int>(std::clamp(std::ceil(cells), 1.0, double{kMaxSubRays}));
  const double weight = cell.weight * cell.rays * cell.slices / n_sub_rays;
  for (int q = 0; q < n_sub_rays; ++q) {
    const CellOffset offset = cell_offset(q, n_sub_rays);
    std::vector<MediaBoundary>& moved = scratch.moved;
    moved.assign(boundaries.begin(), boundaries.end());
    for (MediaBoundary& b : moved) {
      b.bin += offset.ray * cell.rays * b.bin_per_ray +
               (offset.slice * cell.slices + cell.shift) * b.bin_per_slice;
    }
    // Insertion sort: the boundaries are few, and nearly in order already.
    for (std::size_t n = 1; n < moved.size(); ++n) {
      for (std::size_t p = n; p > 0 && moved[p].bin < moved[p - 1].bin; --p) {
        std::swap(moved[p], moved[p - 1]);
      }
    }
    double in = 0.0, back = 0.0, scattering = 0.0;
    for (std::size_t n = 0; n + 1 < moved.size(); ++n) {
      const Material& medium = media_[moved[n].medium];
      in += moved[n].sign * medium.extinction_per_m;
      back += moved[n].sign * medium.extinction_back_per_m;
      scattering += moved[n].sign * medium.scattering_per_m;
      const double x = moved[n].bin;
      const double x_end = std::min({moved[n + 1].bin, end_of_ray, n_bins});
      const auto append = [&](std::uint32_t bin, double near, double far) {
        scratch.bin.push_back(bin);
        scratch.length_m.push_back(static_cast<float>((far - near) * spacing_m));
        scratch.extinction.push_back(static_cast<float>(std::max(0.0, in)));
        if (!two_way_equal_) scratch.extinction_back.push_back(static_cast<float>(std::max(0.0, back)));
        scratch.scattering.push_back(static_cast<float>(std::max(0.0, scattering) * weight));
      };
      // One segment covers all that lies before bin 0: it only attenuates.
      if (x < x_end && x < 0.0) append(kNoBin, x, std::min(0.0, x_end));
      for_each_bin_part(std::max(0.0, x), x_end,
                        [&](double bin, double near, double far) { append(static_cast<std::uint32_t>(bin), near, far); });
    }
    scratch.ray_begin.push_back(static_cast<std::uint32_t>(scratch.bin.size()));
    scratch.ray_row.push_back(0);
    scratch.ray_k.push_back(static_cast<std::uint32_t>(k));
  }
}

void Media::apply(const ViewRays& rays, Integrator integrator, int first, int end, double weight, Slice& slice,
                  MediaScratch& scratch, std::span<double> bins, LayerRow* layers,
                  std::span<const MediaSubset> subsets) const {
  const double spacing_m = rays.grid.acquisition().range_spacing_m;
  const double n_bins = static_cast<double>(bins.size());
  scratch.clear();
  for (const MediaSubset& subset : subsets) subset.scratch->clear();
  const auto integrate_batch = [&](MediaScratch& batch, std::span<double> to, LayerRow* also_to) {
    const SegmentSpans<float> segments{batch.ray_begin, batch.ray_row, batch.bin, batch.length_m};
    const FieldSamples<float> field{batch.extinction, batch.extinction_back, batch.scattering,
                                    SourceForm::scattering};
    integrate(segments, field, integrator, static_cast<int>(to.size()), to);
    if (also_to != nullptr) {
      batch.contributions.resize(batch.bin.size());
      contributions(segments, field, integrator, batch.contributions);
      add_layers(batch, *also_to);
    }
    batch.clear();
  };

  const int last = std::min(end, slice.first + slice.n_rays);
  for (int k = std::max(first, slice.first); k < last; ++k) {
    const auto m = static_cast<std::size_t>(k - slice.first + 1);
    find_boundaries(rays, slice, k, scratch);
    const std::vector<MediaBoundary>& boundaries = scratch.boundaries;
    if (boundaries.empty()) continue;
    const bool stopped = slice.surface[m] != kNoTriangle;
    const double end_of_ray = stopped ? slice.bin[m] : std::numeric_limits<double>::infinity();
    if (stopped) {
      slice.gamma[m] *= static_cast<float>(std::exp(-depth_before(end_of_ray, spacing_m, boundaries)));
    }
    if (layers != nullptr) {
      const double plane_bin = layers->view().plane_bin(k);
      if (std::isfinite(plane_bin) && depth_before(plane_bin, spacing_m, boundaries) > kHalfPower) {
        layers->hide_behind(k);
      }
    }
    append_ray({weight}, spacing_m, end_of_ray, n_bins, k, boundaries, scratch);
    for (const MediaSubset& subset : subsets) {
      if (m % static_cast<std::size_t>(subset.k_step) != 0) continue;
      append_ray({weight, double(subset.k_step), double(subset.group.n_slices), subset.group.shift}, spacing_m,
                 end_of_ray, n_bins, k, boundaries, *subset.scratch);
    }
    if (scratch.bin.size() < kMostSegments) continue;
    integrate_batch(scratch, bins, layers);
    for (const MediaSubset& subset : subsets) integrate_batch(*subset.scratch, subset.bins, nullptr);
  }
  integrate_batch(scratch, bins, layers);
  for (const MediaSubset& subset : subsets) integrate_batch(*subset.scratch, subset.bins, nullptr);
}

}  // namespace sarnerf
