// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "appearance.h"
#include "layers/layer_row.h"
#include "plan.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/trace/ray_tracer.h"
#include "voxel/voxel_scene.h"

namespace sarnerf {

/// Where a fan's rays meet the infinite ground plane, for engines that process rays one by one. Each ray
/// represents the ground within its angular step, so that together they cover it without gaps.
class GroundRays {
 public:
  /// `rays` must outlive it.
  GroundRays(const ViewRays& rays, const Appearance& appearance, double height_m);

  /// Whether the plane has no texture, so that it needs no rays of its own.
  bool uniform() const { return !appearance_.checker; }

  /// Range offset at which ray k meets the plane (m); infinite if it does not.
  double offset_m(int k) const { return offset_m_[static_cast<std::size_t>(k)]; }

  /// Adds the power of the ground that ray k sees at `along_track_m`, times `weight`, in units of γ times ray steps.
  void deposit(int k, double along_track_m, double weight, std::span<double> bins) const;

 private:
  const ViewRays& rays_;
  Appearance appearance_;
  std::vector<double> offset_m_, gamma_;        ///< per ray
  std::vector<double> first_bin_, last_bin_;    ///< per ray: the bin coordinates between which it covers the ground
};

/// The rays of one slice that may meet occupied voxels, as arrays for tracing, and their hits.
struct PackedRow {
  std::vector<float> origin_x, origin_y, origin_z, direction_x, direction_y, direction_z;
  std::vector<float> distance, normal_x, normal_y, normal_z;
  std::vector<std::uint32_t> box;

  /// Copies the rays of these ranges of k, in order, at an along-track coordinate.
  void pack(const ViewRays& rays, double along_m, std::span<const RayRange> ranges);

  RayRow rays(float far_m) const {
    return {origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, far_m};
  }
  HitRow hits() { return {distance, normal_x, normal_y, normal_z, box}; }
};

/// The rays of each azimuth row that may meet occupied voxels: for each row the rays k of a fan, as disjoint
/// ranges in ascending order. Empty space between objects costs nothing, however large it is.
class VisibleRays {
 public:
  /// `boxes_from_aim`: boxes of occupied voxels, relative to the aim point, world axes. Cost: boxes times the
  /// rows that each of them spans.
  VisibleRays(const Acquisition& acquisition, const Fan& fan, std::span<const Box> boxes_from_aim);

  std::span<const RayRange> row(int i) const { return rows_[static_cast<std::size_t>(i)]; }

 private:
  std::vector<std::vector<RayRange>> rows_;
};

/// Scratch of one worker that renders rows of a volume.
struct VoxelWorker {
  VoxelWorker(const BrickView<const float>& grid, const VoxelScene& scene, double longest_m)
      : marcher(grid, scene.volume.channels, scene.occupancy, longest_m) {}

  /// Additional scratch for layers.
  struct LayerScratch {
    LayerRow row;
    VolumeSurface surface;
    std::array<std::vector<double>, RayTracer::kRowsPerBlock> ground;  ///< of each slice
  };

  VolumeMarcher marcher;
  AzimuthRows rows;
  std::array<PackedRow, RayTracer::kRowsPerBlock> packed;  ///< of each slice
  std::vector<int> packed_k;      ///< k of each packed ray
  std::vector<MarchRay> marched;  ///< rays of a step that entered occupied voxels
  std::vector<double> depth;      ///< two-way optical depth along each of them
  std::vector<bool> consecutive;  ///< packed rays n and n + 1 are neighbours
  std::vector<double> bins, ground_bins;
  std::optional<LayerScratch> layers;
  std::size_t n_counted = 0;  ///< packed rays of the block whose hits and ground are already counted
  std::uint64_t n_hits = 0;
};

/// Approximate number of segments that a worker holds before it deposits them: bounds its memory for long rays
/// and fine voxels. Layers need all segments of a slice at once.
inline constexpr std::size_t kMostSegments = std::size_t{1} << 18;
/// Bytes of a worker's scratch for each segment, including the spare capacity of growing vectors.
inline constexpr std::uint64_t kBytesPerSegment = 128;
/// The same for each packed ray of each slice.
inline constexpr std::uint64_t kPackedBytesPerRay = 96;

/// One view of a volume, row by row; rows are independent. Embree finds where rays enter occupied voxels. From there
/// AzimuthRows marches them, some slices at a time, and deposits them over their footprints.
class VoxelView {
 public:
  /// `scene` and `plan` must outlive it; the plan has at least one ray.
  VoxelView(const VoxelScene& scene, const ViewPlan& plan);

  VoxelWorker make_worker() const;

  /// Writes row i of the image, and of the layers that the plan asks for.
  void render_row(int i, VoxelWorker& w, RenderedView& out, const Monitor& monitor) const;

 private:
  struct Block {
    int row = 0;
    std::size_t n_slices = 0;
    std::array<double, RayTracer::kRowsPerBlock> along_m{};
  };
  /// Packed rays [first, end) of all slices of a block.
  struct Part {
    std::size_t first, end;
  };

  void trace(const Block& block, std::span<const RayRange> ranges, VoxelWorker& w) const;
  void march(const Block& block, std::size_t slice, const Part& part, VoxelWorker& w) const;
  Part march_part(const Block& block, std::size_t first, VoxelWorker& w) const;
  void see_ground(const Block& block, std::size_t slice, int k, double passed, VoxelWorker& w) const;
  void see_bare_ground(const Block& block, std::size_t slice, std::span<const RayRange> ranges,
                       VoxelWorker& w) const;
  double two_way_per_m(const VoxelWorker& w, std::size_t segment) const;
  void add_to_layers(std::size_t slice, VoxelWorker& w) const;
  bool plane_is_hidden(std::uint32_t ray, double plane_bin, const VoxelWorker& w) const;

  const VoxelScene& scene_;
  const ViewPlan& plan_;
  Box box_m_;  ///< the volume's support; the aim point if that is empty
  VisibleRays visible_;
  ViewRays rays_;
  std::optional<GroundRays> ground_;
  std::vector<double> bare_ground_;  ///< bins of a uniform ground that nothing hides, all slices of a row
  bool uniform_ground_ = false;
  std::optional<LayerView> layers_;
  BrickView<const float> grid_;
  std::vector<double> beta0_per_mass_;  ///< (r_j Δθ / Δr), averaged over the row's slices
};

}  // namespace sarnerf
