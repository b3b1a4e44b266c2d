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

/// How the power of a ray is distributed over the range bins of its azimuth row.
enum class Deposit {
  in_bin,          ///< each segment's power goes into the bin that holds it: one look-up, with an exact adjoint
  over_footprint,  ///< power is spread over the ray's footprint, half-way to its neighbours: no gaps with few rays
};

/// Integral of a unit-mass trapezoid, the convolution of boxes of widths `wide` ≥ `narrow`, from its
/// left end to y.
struct TrapezoidIntegral {
  double wide, narrow, inverse_wide, inverse_ramp;

  TrapezoidIntegral(double a, double b)
      : wide(std::max(a, b)),
        narrow(std::min(a, b)),
        inverse_wide(1.0 / wide),
        // Ramps below a millionth of the plateau count as steps: the integrals differ by less than that.
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

/// Calls f(j, fraction) for each of the bins [0, n_bins) that overlap a uniform density on [x0, x1] (either
/// order), convolved with a box of width |smear|; bin j covers [j, j + 1). The fractions of all bins, those
/// outside [0, n_bins) included, add up to 1.
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

/// Spreads `mass` over range bins: a uniform density on [x0, x1] (either order) convolved with a box of
/// width |smear|, all in bin coordinates, where bin j covers [j, j + 1). That trapezoid is integrated exactly
/// over each bin; the part outside the bins is dropped.
///
/// This keeps the image free of aliasing with few rays: between neighbouring rays a plane spans the interval
/// [x0, x1], and over the width of a slice it moves by `smear`.
/// Cost: a few ns, plus about 2 ns for each bin touched.
inline void deposit_trapezoid(std::span<double> bins, double x0, double x1, double smear, double mass) {
  for_each_share(bins.size(), x0, x1, smear,
                 [&](std::size_t j, double share) { bins[j] += mass * share; });
}

/// Range interval from which one segment of a ray emits, modelled as a box.
struct SegmentEmission {
  double bin = 0.0;    ///< mean, in bin coordinates
  double width = 0.0;  ///< in bins
};

/// Emission of a segment of two-way optical depth `depth`: near its front if it is opaque, from its whole length
/// if it is thin. `first_bin`: bin coordinate of its near end, `length`: in bins.
SegmentEmission segment_emission(double first_bin, double length, double depth);

/// Range interval (bins) over which a ray's power is spread, relative to the point of emission.
struct RangeSpan {
  double first = 0.0, last = 0.0;
};

/// Spreads the power of the rays of some neighbouring slices over range bins. A ray represents its step of angle and its
/// slice's width: its emission is spread over the range half-way to the centroids of its neighbours, so that on a
/// continuous surface footprints meet without gap or overlap, however few rays there are. Where one neighbour sees another
/// surface, the other one's step is used on both sides; where both do, the power is not spread.
///
/// Rays lie on a lattice of slices × places; adjacent places hold rays k and k + 1 of a fan, unless begin() is told otherwise.
class FootprintDeposit {
 public:
  /// Stands for "no ray" at a position of the lattice: nothing was met there.
  static constexpr std::uint32_t kNoRay = 0xffffffffu;

  /// Empties the lattice. `consecutive[n]`: whether places n and n + 1 are neighbours in the fan.
  void begin(std::size_t n_slices, const std::vector<bool>& consecutive);

  /// Sets the batch's number of the ray at a position of the lattice.
  void set_ray(std::size_t slice, std::size_t place, std::uint32_t ray) { slices_[slice].batch_ray[place] = ray; }
  std::uint32_t ray(std::size_t slice, std::size_t place) const { return slices_[slice].batch_ray[place]; }

  std::size_t n_slices() const { return n_slices_; }
  std::size_t n_places() const { return consecutive_.size(); }

  /// Computes power and centroid of the emission of each ray at places [first, end). The spans are those of the batch whose
  /// numbers set_ray() got. `near_bin`: bin coordinates of the segments' near ends; `spacing_m`: bin spacing.
  void emit(const SegmentSpans<float>& segments, const FieldSamples<float>& field, std::span<const double> near_bin,
            double spacing_m, Integrator integrator, std::size_t first, std::size_t end);

  /// Calls visit(segment, contribution, x0, x1, smear) for the trapezoids (deposit_trapezoid) of one ray. The emissions of the
  /// ray and of its neighbours must have been computed. Segments of negligible contribution (kLeastPart) are left out.
  template <class Visit>
  void for_each_trapezoid(std::span<const std::uint32_t> ray_begin, std::size_t slice, std::size_t place,
                          Visit&& visit) const;

  /// Σ c_s of a ray.
  double mass(std::size_t slice, std::size_t place) const { return slices_[slice].mass[place]; }

 private:
  /// The rays of a slice, indexed by their places.
  struct Slice {
    std::vector<double> mass;      ///< Σ c_s
    std::vector<double> centroid;  ///< Σ c_s x_s / Σ c_s, range in bin coordinates
    std::vector<std::uint32_t> batch_ray;
  };
  /// Segments that contribute less than this fraction of the sum before them on their ray are left out.
  static constexpr double kLeastPart = 1e-7;

  RangeSpan over_ray(std::size_t slice, std::size_t place) const;
  double over_slice(std::size_t slice, std::size_t place) const;
  double step(std::size_t slice, std::size_t place, std::size_t other_slice, std::size_t other_place) const;

  std::size_t n_slices_ = 0;
  std::vector<Slice> slices_;  ///< at least n_slices_ of them: memory is kept
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
