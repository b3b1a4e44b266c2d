// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/deposit.h"

#include <limits>

namespace sarnerf {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
/// A neighbour that emits less than this fraction of a ray's power is not used for its footprint.
constexpr double kLeastMass = 1e-2;
/// Longest step (bins) that is accepted from one neighbour alone. Longer steps must agree on both sides within a factor
/// of two, as they do on a steep surface; otherwise the neighbours see other surfaces.
constexpr double kLongestLoneStep = 1.0;

RangeSpan span_of_steps(double before, double behind) {
  const double least = std::min(std::abs(before), std::abs(behind));
  const double most = std::max(std::abs(before), std::abs(behind));
  if (least == kUnknown) return {};
  if (before * behind < 0.0 && most <= 2.0 * least) {
    return {0.5 * std::min(before, behind), 0.5 * std::max(before, behind)};
  }
  return least <= kLongestLoneStep ? RangeSpan{-0.5 * least, 0.5 * least} : RangeSpan{};
}

}  // namespace

SegmentEmission segment_emission(double first_bin, double length, double depth) {
  // ∫ s e^(−xs/ℓ) ds / ∫ e^(−xs/ℓ) ds over the segment, in lengths.
  double mean = 0.5 - depth / 12.0;
  if (depth > 0.01) {
    mean = 1.0 / depth;
    if (depth < 30.0) mean -= 1.0 / (static_cast<double>(std::exp(static_cast<float>(depth))) - 1.0);
  }
  return {first_bin + mean * length, 2.0 * mean * length};
}

void FootprintDeposit::begin(std::size_t n_slices, const std::vector<bool>& consecutive) {
  n_slices_ = n_slices;
  consecutive_ = consecutive;
  if (slices_.size() < n_slices) slices_.resize(n_slices);
  for (std::size_t slice = 0; slice < n_slices; ++slice) {
    slices_[slice].mass.assign(consecutive.size(), 0.0);
    slices_[slice].centroid.assign(consecutive.size(), 0.0);
    slices_[slice].batch_ray.assign(consecutive.size(), kNoRay);
  }
}

void FootprintDeposit::emit(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                            std::span<const double> near_bin, double spacing_m, Integrator integrator, std::size_t first,
                            std::size_t end) {
  const std::span<const float> forth = field.extinction_per_m;
  const std::span<const float> back = field.extinction_back_per_m.empty() ? forth : field.extinction_back_per_m;
  contributions_.resize(segments.bin.size());
  emitted_.resize(segments.bin.size());
  contributions(segments, field, integrator, contributions_);
  for (std::size_t slice = 0; slice < n_slices_; ++slice) {
    Slice& rays = slices_[slice];
    for (std::size_t place = first; place < end; ++place) {
      const std::uint32_t number = rays.batch_ray[place];
      if (number == kNoRay) continue;
      double mass = 0.0, moment = 0.0;
      for (std::size_t s = segments.ray_begin[number]; s < segments.ray_begin[number + 1]; ++s) {
        const double c = contributions_[s];
        if (!(c > kLeastPart * mass)) continue;
        const double length_m = double{segments.length_m[s]};
        emitted_[s] = segment_emission(near_bin[s], length_m / spacing_m, length_m * (double{forth[s]} + double{back[s]}));
        mass += c;
        moment += c * emitted_[s].bin;
      }
      rays.mass[place] = mass;
      rays.centroid[place] = mass > 0.0 ? moment / mass : 0.0;
    }
  }
}

/// Distance (bins) from this ray's centroid to the other one's, positive if that is farther; infinite if the other ray emits
/// too little.
double FootprintDeposit::step(std::size_t slice, std::size_t place, std::size_t other_slice, std::size_t other_place) const {
  const double own = slices_[slice].mass[place], other = slices_[other_slice].mass[other_place];
  if (!(other > kLeastMass * own)) return kUnknown;
  return slices_[other_slice].centroid[other_place] - slices_[slice].centroid[place];
}

/// Range over which the ray's power is spread by its step of k.
RangeSpan FootprintDeposit::over_ray(std::size_t slice, std::size_t place) const {
  const std::size_t last = n_places() - 1;
  const double before = place > 0 && consecutive_[place - 1] ? step(slice, place, slice, place - 1) : kUnknown;
  const double behind = place < last && consecutive_[place] ? step(slice, place, slice, place + 1) : kUnknown;
  return span_of_steps(before, behind);
}

/// Range (bins) by which the ray's centroid moves over the slice's width.
double FootprintDeposit::over_slice(std::size_t slice, std::size_t place) const {
  const double before = slice > 0 ? step(slice, place, slice - 1, place) : kUnknown;
  const double behind = slice + 1 < n_slices_ ? step(slice, place, slice + 1, place) : kUnknown;
  const RangeSpan span = span_of_steps(before, behind);
  return span.last - span.first;
}

}  // namespace sarnerf
