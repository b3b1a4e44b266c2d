// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/mpa/integrate.h"

namespace sarnerf {

/// Where the power of a ray goes in its azimuth row.
enum class Deposit {
  in_bin,          ///< each segment's into the bin that it lies in: one look-up, and the exact adjoint of it
  over_footprint,  ///< over the range that the ray stands for between its neighbours: no gaps, however few rays there are
};

/// Integral of a unit-mass trapezoid, the convolution of boxes of widths `wide` ≥ `narrow`, from its
/// left end to y.
struct TrapezoidIntegral {
  double wide, narrow, inverse_wide, inverse_ramp;

  TrapezoidIntegral(double a, double b)
      : wide(std::max(a, b)),
        narrow(std::min(a, b)),
        inverse_wide(1.0 / wide),
        // Ramps below a millionth of the plateau are steps: their integrals differ by less than that.
        inverse_ramp(narrow > 1e-6 * wide ? 0.5 / (wide * narrow) : 0.0) {}

  double operator()(double y) const {
    const double rest = wide + narrow - y;
    if (y <= 0.0) return 0.0;
    if (rest <= 0.0) return 1.0;
    if (y < narrow) return y * y * inverse_ramp;
    if (rest < narrow) return 1.0 - rest * rest * inverse_ramp;
    return (y - 0.5 * narrow) * inverse_wide;
  }
};

/// Calls f(j, share) for each of the bins [0, n_bins) that a uniform density on [x0, x1] (either order),
/// smeared by a box of width |smear|, touches; bin j covers [j, j + 1). Shares of all bins, also those
/// outside, add up to 1.
template <class F>
void for_each_share(std::size_t n_bins, double x0, double x1, double smear, F&& f) {
  const double width = std::abs(smear);
  const double first = std::min(x0, x1) - 0.5 * width;
  const double last = std::max(x0, x1) + 0.5 * width;
  const double end_of_bins = static_cast<double>(n_bins);
  if (!(last >= 0.0 && first < end_of_bins)) return;

  const double first_bin = std::floor(first);
  if (last < first_bin + 1.0) {  // the commonest case: all in one bin
    f(static_cast<std::size_t>(first_bin), 1.0);
    return;
  }
  const TrapezoidIntegral integral(std::abs(x1 - x0), width);
  const auto begin = static_cast<std::ptrdiff_t>(std::max(first_bin, 0.0));
  const auto end = static_cast<std::ptrdiff_t>(std::min(std::floor(last) + 1.0, end_of_bins));
  double below = integral(static_cast<double>(begin) - first);
  for (std::ptrdiff_t j = begin; j < end; ++j) {
    const double above = integral(static_cast<double>(j + 1) - first);
    f(static_cast<std::size_t>(j), above - below);
    below = above;
  }
}

/// Spreads `mass` over range bins: a uniform density on [x0, x1] (either order) smeared by a box of
/// width |smear|, all in bin coordinates, where bin j covers [j, j + 1). Exact integration of that
/// trapezoid over each bin; what falls outside the bins is dropped.
///
/// This is what makes the image free of aliasing with few rays: between neighbouring rays a plane spans
/// the interval [x0, x1], and over the width of a slice it moves by `smear`.
/// Cost: a few ns, plus about 2 ns for each bin touched.
inline void deposit_trapezoid(std::span<double> bins, double x0, double x1, double smear, double mass) {
  for_each_share(bins.size(), x0, x1, smear,
                 [&](std::size_t j, double share) { bins[j] += mass * share; });
}

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

/// The power of the rays of some neighbouring slices, spread over range bins. A ray stands for its step of angle and its
/// slice's width: what it emits is spread over the range half-way to the centroids of its neighbours, so that on a
/// continuous surface rays meet without gap or overlap, however few they are. Where a neighbour sees something else, the
/// other one decides; where both do, nothing is spread.
///
/// Rays lie on a lattice of slices × places; places beside each other hold rays k and k + 1 of a fan, unless said otherwise.
class FootprintDeposit {
 public:
  /// Ray of a batch that does not exist: nothing was met there.
  static constexpr std::uint32_t kNoRay = 0xffffffffu;

  /// Empties the lattice. `consecutive[n]`: whether places n and n + 1 are neighbours in the fan.
  void begin(std::size_t n_slices, const std::vector<bool>& consecutive);

  /// Which ray of the batch lies at a place.
  void set_ray(std::size_t slice, std::size_t place, std::uint32_t ray) { slices_[slice].batch_ray[place] = ray; }
  std::uint32_t ray(std::size_t slice, std::size_t place) const { return slices_[slice].batch_ray[place]; }

  std::size_t n_slices() const { return n_slices_; }
  std::size_t n_places() const { return consecutive_.size(); }

  /// Finds what each ray at the places [first, end) emits, and where. The spans are of the batch that set_ray() numbers, with
  /// bin coordinates of the segments' near ends, and bins of `spacing_m`.
  void emit(const SegmentSpans<float>& segments, const FieldSamples<float>& field, std::span<const double> near_bin,
            double spacing_m, Integrator integrator, std::size_t first, std::size_t end);

  /// Calls visit(segment, contribution, x0, x1, smear) for the trapezoids (deposit_trapezoid) of one ray, whose neighbours'
  /// emissions are known, too. Segments that emit next to nothing beside what lies before them on their ray are left out.
  template <class Visit>
  void for_each_trapezoid(std::span<const std::uint32_t> ray_begin, std::size_t slice, std::size_t place,
                          Visit&& visit) const;

  /// Σ c_s of a ray.
  double mass(std::size_t slice, std::size_t place) const { return slices_[slice].mass[place]; }

 private:
  /// Of a slice's rays, by their places.
  struct Slice {
    std::vector<double> mass;      ///< Σ c_s
    std::vector<double> centroid;  ///< Σ c_s x_s / Σ c_s, range in bin coordinates
    std::vector<std::uint32_t> batch_ray;
  };
  /// Segments that emit less than this part of what lies before them on their ray are left out.
  static constexpr double kLeastPart = 1e-7;

  RangeSpan over_ray(std::size_t slice, std::size_t place) const;
  double over_slice(std::size_t slice, std::size_t place) const;
  double step(std::size_t slice, std::size_t place, std::size_t other_slice, std::size_t other_place) const;

  std::size_t n_slices_ = 0;
  std::vector<Slice> slices_;  ///< at least n_slices_: memory is kept
  std::vector<bool> consecutive_;
  std::vector<double> contributions_;     ///< [n_segments]
  std::vector<SegmentEmission> emitted_;  ///< [n_segments]
};

template <class Visit>
void FootprintDeposit::for_each_trapezoid(std::span<const std::uint32_t> ray_begin, std::size_t slice, std::size_t place,
                                          Visit&& visit) const {
  if (!(mass(slice, place) > 0.0)) return;
  const RangeSpan along_fan = over_ray(slice, place);
  const double along_track = over_slice(slice, place);
  const std::uint32_t number = ray(slice, place);
  double before = 0.0;
  for (std::size_t s = ray_begin[number]; s < ray_begin[number + 1]; ++s) {
    const double c = contributions_[s];
    if (!(c > kLeastPart * before)) continue;
    before += c;
    const SegmentEmission& at = emitted_[s];
    visit(s, c, at.bin + along_fan.first, at.bin + along_fan.last, along_track + at.width);
  }
}

}  // namespace sarnerf
