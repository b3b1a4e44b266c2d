// SPDX-License-Identifier: Apache-2.0
#include "footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sarnerf {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
/// Rays that emit less than this part of a neighbour's power say nothing about its surface.
constexpr double kLeastMass = 1e-2;
/// Longest step (bins) that one neighbour can vouch for. Longer ones need both to agree within a factor of
/// two, as they do on a steep surface; else the neighbours see other surfaces.
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

void SliceEmission::assign(std::size_t n_rays) {
  mass.assign(n_rays, 0.0);
  centroid.assign(n_rays, 0.0);
  batch_ray.assign(n_rays, kNoRay);
}

SegmentEmission segment_emission(double first_bin, double length, double depth) {
  // ∫ s e^(−xs/ℓ) ds / ∫ e^(−xs/ℓ) ds over the segment, in lengths.
  double mean = 0.5 - depth / 12.0;
  if (depth > 0.01) {
    mean = 1.0 / depth;
    if (depth < 30.0) mean -= 1.0 / (static_cast<double>(std::exp(static_cast<float>(depth))) - 1.0);
  }
  return {first_bin + mean * length, 2.0 * mean * length};
}

double Footprints::step(std::size_t s, std::size_t n, std::size_t other_s,
                        std::size_t other_n) const {
  const double own = slices_[s].mass[n], other = slices_[other_s].mass[other_n];
  if (!(other > kLeastMass * own)) return kUnknown;
  return slices_[other_s].centroid[other_n] - slices_[s].centroid[n];
}

RangeSpan Footprints::over_ray(std::size_t s, std::size_t n) const {
  const std::size_t last = slices_[s].mass.size() - 1;
  const double before = n > 0 && consecutive_[n - 1] ? step(s, n, s, n - 1) : kUnknown;
  const double behind = n < last && consecutive_[n] ? step(s, n, s, n + 1) : kUnknown;
  return span_of_steps(before, behind);
}

double Footprints::over_slice(std::size_t s, std::size_t n) const {
  const double before = s > 0 ? step(s, n, s - 1, n) : kUnknown;
  const double behind = s + 1 < slices_.size() ? step(s, n, s + 1, n) : kUnknown;
  const RangeSpan span = span_of_steps(before, behind);
  return span.last - span.first;
}

}  // namespace sarnerf
