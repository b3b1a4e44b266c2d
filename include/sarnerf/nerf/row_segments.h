// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sarnerf/mpa/integrator.h"
#include "sarnerf/nerf/density_cache.h"
#include "sarnerf/nerf/level_ground.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// The segments of azimuth rows at which a field that is no grid is evaluated, and the integration of its values to pixels.
/// Rays lie as RowRenderer has them. They are sampled where the cache is occupied, and end at the sampling's end_depth by the
/// cache's extinction. Occupied stretches are cut at the borders of range bins, and the parts evenly until none is longer than
/// the sampling allows.
///
/// Over a level ground rays end on it, and rows add the ground's power times the transmittance to it.
///
/// Threads take fixed parts of the rows, so that results do not depend on their timing. Memory: about 80 bytes
/// a segment.
class RowSegments {
 public:
  RowSegments(std::span<const RowRequest> rows, const RaySampling& sampling,
              const DensityCache& cache, std::shared_ptr<const LevelGround> ground = nullptr);
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

  /// β⁰ of the rows one behind the other, [n_pixels], from κ (1/m) and brightness at the segments.
  void integrate(std::span<const float> extinction_per_m, std::span<const float> brightness,
                 Integrator integrator, std::span<float> pixels);

  /// Its adjoint for the values of the last integrate(): writes ∂L/∂κ and ∂L/∂brightness, [n_segments].
  void adjoint(std::span<const float> pixel_gradients, Integrator integrator,
               std::span<float> d_extinction, std::span<float> d_brightness);

 private:
  void place(std::span<const RowRequest> rows, const DensityCache& cache, RowPart& part) const;

  RaySampling sampling_;
  std::shared_ptr<const LevelGround> ground_;
  std::vector<std::unique_ptr<RowPart>> parts_;
  std::vector<std::size_t> first_segment_, first_pixel_;  ///< of the parts
  std::size_t n_pixels_ = 0;
  std::vector<glm::vec3> point_m_, ray_direction_;
  std::vector<std::uint32_t> ray_begin_;
};

}  // namespace sarnerf
