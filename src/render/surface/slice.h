// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "appearance.h"
#include "plan.h"
#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

/// Marks a sample of a slice that lies on the ground plane instead of a triangle.
inline constexpr std::uint32_t kGroundSurface = 0xfffffffeu;

/// First hits of the rays k of one slice (an azimuth row, or a part of one). Sample m belongs to ray
/// first + (m − 1) · k_step. The slice has one more sample before the first ray and one behind the last.
struct Slice {
  int first = 0;  ///< k of the first ray
  int k_step = 1; ///< rays from one sample to the next; above 1 in subsets of a slice's samples
  int n_rays = 0;
  double along_m = 0.0;  ///< along-track coordinate of the slice's centre
  double width_m = 0.0;  ///< its extent along track

  std::vector<std::uint32_t> surface;  ///< triangle, kGroundSurface or kNoTriangle
  std::vector<float> bin;              ///< x: range in bin coordinates
  std::vector<float> bin_per_ray;      ///< change of x over one step of k on the surface's plane
  std::vector<float> bin_per_slice;    ///< change of x over the slice's width on the surface's plane
  std::vector<float> gamma;            ///< γ, with texture
  std::vector<float> cosine;           ///< −n·d on triangles; not set elsewhere

  void resize(int n);
  /// Multiplies γ by the slice's weight.
  void scale(double weight);
  int k_of(std::size_t m) const { return first + k_step * (static_cast<int>(m) - 1); }
};

/// Bytes of a worker's scratch for each ray of each slice that it traces at once.
inline constexpr std::uint64_t kSliceBytesPerRay = 52;
/// The same for each ray of a slice that meets the ground only.
inline constexpr std::uint64_t kBareSliceBytesPerRay = 24;

/// Neighbouring slices over the same rays k. Tracing them together is faster.
struct SliceBlock {
  std::array<Slice, RayTracer::kRowsPerBlock> slices;
  std::size_t n_slices = 0;

  /// Scratch.
  struct Rays {
    std::vector<float> origin_x, origin_y, origin_z;
    std::vector<float> distance, normal_x, normal_y, normal_z;
    void resize(int n);
  };
  std::array<Rays, RayTracer::kRowsPerBlock> rays;
};

/// Traces rays [first, first + n) of the block's slices and fills all but their two end samples. The
/// slices' along_m, width_m and the block's n_slices must be set. Returns the number of hits.
std::uint64_t trace_slices(const RayTracer& tracer, const ViewRays& rays,
                           const AppearanceTable& table, int first, int n, SliceBlock& block);

/// Fills `slice.gamma` of the rays from their hits: `slice.surface`, `slice.cosine` and, in `scratch`,
/// origins and distances. Returns the number of hits. Cost: linear, vectorised over runs of rays
/// whose hits share their appearance.
std::uint64_t shade(const ViewRays& rays, const AppearanceTable& table,
                    const SliceBlock::Rays& scratch, Slice& slice);

}  // namespace sarnerf
