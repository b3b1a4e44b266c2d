// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/nerf/occupancy_grid.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

struct RowPart;

/// How rows of learned fields are sampled and deposited.
struct RaySampling : RowSampling {
  Deposit deposit = Deposit::in_bin;
};

/// Memory of a RowRenderer.
struct RowMemory;

/// Renders azimuth rows of a sparse field. The backward pass converts derivatives by pixels to derivatives by the
/// field's values, from the segments that the forward pass keeps.
///
/// Rows are sampled and integrated by AzimuthRows. Rays are cast only through the box of the occupied cells, and have
/// segments only in occupied cells. A ray ends at the sampling's end_depth (VolumeMarcher).
///
/// Each thread takes a fixed part of the rows: results may depend on the number of threads, but not on timing.
/// Memory: about 60 bytes a segment of the last forward pass.
class RowRenderer {
 public:
  /// All arguments must outlive the renderer. The grid's frame is centred on the aim point. `memory` may be that of
  /// a former renderer with the same topology and channels: its allocations are reused. With a
  /// `ground`, rays end on it and rows show it.
  RowRenderer(const BrickView<const float>& values, const FieldChannels& channels, const Occupancy& occupancy,
              const RaySampling& sampling, std::shared_ptr<RowMemory> memory = nullptr,
              const LevelGround* ground = nullptr);
  ~RowRenderer();
  RowRenderer(RowRenderer&&) noexcept;
  RowRenderer& operator=(RowRenderer&&) noexcept;

  /// β⁰ of the rows, concatenated: Σ n_range pixels. Throws UsageError for another number of pixels.
  void forward(std::span<const RowRequest> rows, std::span<float> pixels);

  /// From ∂L/∂pixel of the rows of the last forward(), writes ∂L/∂value of these voxels, indices into the topology:
  /// [active.size() × channels]. Harmonics only. All calls with the same memory must pass the same voxels.
  void backward(std::span<const float> pixel_gradients, std::span<const std::uint32_t> active, std::span<float> value_gradients);

  const std::shared_ptr<RowMemory>& memory() const { return memory_; }

 private:
  void forward_part(std::span<const RowRequest> rows, std::span<float> pixels, RowPart& part) const;
  void backward_part(std::span<const float> pixel_gradients, RowPart& part) const;

  BrickView<const float> values_;
  FieldChannels channels_;
  const Occupancy* occupancy_;
  RaySampling sampling_;
  Box box_m_;  ///< of the occupied cells
  const LevelGround* ground_;
  std::shared_ptr<RowMemory> memory_;
};

/// Box of the occupied cells, in the frame of the grid's transform; empty if no cell is occupied.
Box occupied_box(const Occupancy& occupancy, const GridTransform& transform);

/// The segments of azimuth rows at which a field that is not a grid is evaluated, and the integration of its values to pixels.
/// Rays are those of RowRenderer. They are cut into segments (AzimuthRows::cut) where the cache is occupied, and end at the
/// sampling's end_depth, computed from the cache's extinction.
///
/// Rays end on a level ground. Its power, times the transmittance to it, is added to the rows.
///
/// Each thread takes a fixed part of the rows, so that results do not depend on timing. Memory: about 80 bytes
/// a segment.
class RowSegments {
 public:
  RowSegments(std::span<const RowRequest> rows, const RaySampling& sampling,
              const OccupancyGrid& cache, std::shared_ptr<const LevelGround> ground = nullptr);
  ~RowSegments();
  RowSegments(const RowSegments&) = delete;
  RowSegments& operator=(const RowSegments&) = delete;

  std::size_t n_segments() const { return point_m_.size(); }
  std::size_t n_pixels() const { return n_pixels_; }

  /// Centres of the segments, and the rays they lie on, as in SampleBatch.
  std::span<const glm::vec3> point_m() const { return point_m_; }
  std::span<const glm::vec3> ray_direction() const { return ray_direction_; }
  std::span<const std::uint32_t> ray_begin() const { return ray_begin_; }

  /// Length (m) of each segment, the bin coordinate at which it begins, and number of its row among the requests.
  struct Place {
    double length_m, near_bin;
    std::size_t row;
  };
  std::vector<Place> places() const;

  /// β⁰ of the rows, concatenated, [n_pixels], from κ (1/m) and brightness at the segments.
  /// `bounce`: brightness of Path::by_ground, or empty; it needs a ground.
  void integrate(std::span<const float> extinction_per_m, std::span<const float> brightness,
                 Integrator integrator, std::span<float> pixels, std::span<const float> bounce = {});

  /// Adjoint at the values of the last integrate(), from ∂L/∂pixel: writes ∂L/∂κ and ∂L/∂brightness, [n_segments].
  void adjoint(std::span<const float> pixel_gradients, Integrator integrator, std::span<float> d_extinction,
               std::span<float> d_brightness, std::span<float> d_bounce = {});

 private:
  void place(std::span<const RowRequest> rows, const OccupancyGrid& cache, RowPart& part) const;

  RaySampling sampling_;
  std::shared_ptr<const LevelGround> ground_;
  std::vector<std::unique_ptr<RowPart>> parts_;
  std::vector<std::size_t> first_segment_, first_pixel_;  ///< of the parts
  std::size_t n_pixels_ = 0;
  std::vector<glm::vec3> point_m_, ray_direction_;
  std::vector<std::uint32_t> ray_begin_;
};

}  // namespace sarnerf
