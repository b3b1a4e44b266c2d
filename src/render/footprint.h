// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/mpa/integrate.h"

namespace sarnerf {

/// What the rays of one slice emit, by their places in a packed row. Rays that met nothing have no mass.
struct SliceEmission {
  std::vector<double> mass;      ///< Σ c_s
  std::vector<double> centroid;  ///< Σ c_s x_s / Σ c_s, range in bin coordinates
  std::vector<std::uint32_t> batch_ray;  ///< the ray's number in the batch, or kNoRay

  static constexpr std::uint32_t kNoRay = 0xffffffffu;
  void assign(std::size_t n_rays);
};

/// Where, on range, one segment of a ray emits.
struct SegmentEmission {
  double bin = 0.0;    ///< mean, in bin coordinates
  double width = 0.0;  ///< of the box that stands for it
};

/// Mean position and width of what a segment of two-way depth x emits: near its front if it is opaque,
/// anywhere in it if it is thin. `first_bin`: bin coordinate of its near end, `length`: in bins.
SegmentEmission segment_emission(double first_bin, double length, double depth);

/// Range (bins) that a ray stands for, relative to the centroid of what it emits.
struct RangeSpan {
  double first = 0.0, last = 0.0;
};

/// Places what rays emit on range bins. A ray stands for its step of angle and its slice's width: what it
/// emits is spread over the range half-way to the centroids of its neighbours, so that on a continuous
/// surface rays meet without gap or overlap, however few they are. Where a neighbour sees something else,
/// the other one decides; where both do, nothing is spread.
class Footprints {
 public:
  /// `consecutive[n]`: whether the packed rays n and n + 1 are neighbours.
  Footprints(std::span<const SliceEmission> slices, const std::vector<bool>& consecutive)
      : slices_(slices), consecutive_(consecutive) {}

  /// What packed ray n of slice s stands for in its step of k.
  RangeSpan over_ray(std::size_t s, std::size_t n) const;
  /// Range (bins) by which its centroid moves over the slice's width.
  double over_slice(std::size_t s, std::size_t n) const;

 private:
  /// How far (bins) the other ray's centroid lies beyond this one's; infinite if it says nothing.
  double step(std::size_t s, std::size_t n, std::size_t other_s, std::size_t other_n) const;

  std::span<const SliceEmission> slices_;
  const std::vector<bool>& consecutive_;
};

}  // namespace sarnerf
