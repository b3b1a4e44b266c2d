// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "footprint.h"
#include "ground_rays.h"
#include "layer_row.h"
#include "packed_row.h"
#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/render/engine.h"
#include "visible_rays.h"
#include "volume_surface.h"
#include "voxel_scene.h"

namespace sarnerf {

/// Scratch of one worker that renders rows of a volume.
struct VoxelWorker {
  VoxelWorker(const BrickView<const float>& grid, const VoxelScene& scene, double longest_m)
      : marcher(grid, scene.volume.channels, scene.occupancy, longest_m) {}

  /// What layers need beside the image.
  struct LayerScratch {
    LayerRow row;
    VolumeSurface surface;
    std::array<std::vector<double>, RayTracer::kRowsPerBlock> ground;  ///< of each slice
  };

  VolumeMarcher marcher;
  SampleBatch batch;
  BatchField field;
  std::array<PackedRow, RayTracer::kRowsPerBlock> rows;
  std::array<SliceEmission, RayTracer::kRowsPerBlock> emission;
  std::vector<int> packed_k;      ///< k of each packed ray
  std::vector<MarchRay> marched;  ///< rays of a step that entered matter
  std::vector<double> depth;      ///< what they passed
  std::vector<bool> consecutive;  ///< packed rays n and n + 1 are neighbours
  std::vector<double> contributions, bins, ground_bins;
  std::vector<SegmentEmission> emitted;  ///< per segment
  std::optional<LayerScratch> layers;
  std::size_t n_counted = 0;  ///< packed rays of the block whose hits and ground are counted
  std::uint64_t n_hits = 0;
};

/// Segments that a worker holds before it deposits them, about: bounds its memory where rays are long and
/// voxels fine. Layers need all segments of a slice at once.
inline constexpr std::size_t kMostSegments = std::size_t{1} << 18;
/// Bytes of a worker's scratch for each of them, with what growing vectors hold in reserve.
inline constexpr std::uint64_t kBytesPerSegment = 128;
/// And for each packed ray of each slice.
inline constexpr std::uint64_t kPackedBytesPerRay = 96;

/// One view of a volume, row by row; rows are independent.
class VoxelView {
 public:
  /// `scene` and `plan` must outlive it; the plan has at least one ray.
  VoxelView(const VoxelScene& scene, const ViewPlan& plan);

  VoxelWorker make_worker() const;

  /// Writes row i of the image, and of the layers that the plan asks for.
  void render_row(int i, VoxelWorker& w, RenderedView& out, const Monitor& monitor) const;

 private:
  struct Block {
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
  void find_emissions(const Block& block, const Part& part, VoxelWorker& w) const;
  SegmentEmission emission_of_segment(const VoxelWorker& w, std::size_t segment) const;
  double two_way_per_m(const VoxelWorker& w, std::size_t segment) const;
  void deposit(std::size_t slice, const Part& part, const Footprints& footprints, VoxelWorker& w) const;
  void add_to_layers(std::size_t slice, const Footprints& footprints, VoxelWorker& w) const;
  bool plane_is_hidden(std::uint32_t ray, double plane_bin, const VoxelWorker& w) const;

  const VoxelScene& scene_;
  const ViewPlan& plan_;
  Box box_m_;  ///< of what can be seen
  VisibleRays visible_;
  ViewRays rays_;
  std::optional<GroundRays> ground_;
  std::vector<double> bare_ground_;  ///< of a uniform ground that nothing hides, all slices of a row
  bool uniform_ground_ = false;
  std::optional<LayerView> layers_;
  BrickView<const float> grid_;
  std::vector<double> beta0_per_mass_;  ///< (r_j Δθ / Δr), averaged over the row's slices
};

}  // namespace sarnerf
