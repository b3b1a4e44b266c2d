// SPDX-License-Identifier: Apache-2.0
#include "ray_distortion.h"

#include "sarnerf/mpa/integrate.h"

namespace sarnerf {
namespace {

/// ∂D/∂w of a ray's segments, given their weights.
void by_weight(std::span<const double> weight, std::span<const double> range_bin, std::span<const double> length_bins,
               std::span<float> out) {
  double all_w = 0.0, all_wr = 0.0;
  for (std::size_t s = 0; s < weight.size(); ++s) {
    all_w += weight[s];
    all_wr += weight[s] * range_bin[s];
  }
  double nearer_w = 0.0, nearer_wr = 0.0;
  for (std::size_t s = 0; s < weight.size(); ++s) {
    const double w = weight[s], r = range_bin[s];
    const double farther_w = all_w - nearer_w - w, farther_wr = all_wr - nearer_wr - w * r;
    const double spread = (r * nearer_w - nearer_wr) + (farther_wr - r * farther_w);
    out[s] = static_cast<float>(std::max(0.0, 2.0 * spread + 2.0 / 3.0 * w * length_bins[s]));
    nearer_w += w;
    nearer_wr += w * r;
  }
}

}  // namespace

void add_distortion_gradient(RowPart& part, const std::function<double(const RowPart::Row&)>& weight) {
  std::vector<double> w, range_bin, length_bins;
  std::vector<float> spread(part.batch.n_segments()), d_extinction(spread.size()), unused(spread.size());
  for (const RowPart::Row& row : part.rows) {
    const double bins_per_m = 1.0 / row.acquisition.range_spacing_m;
    const auto row_weight = static_cast<float>(weight(row));
    for (std::size_t q = row.first_ray; q < row.end_ray; ++q) {
      const std::uint32_t begin = part.batch.ray_begin[q], n = part.batch.ray_begin[q + 1] - begin;
      w.resize(n);
      range_bin.resize(n);
      length_bins.resize(n);
      double transmittance = 1.0;
      for (std::uint32_t s = 0; s < n; ++s) {
        const double length_m = double{part.batch.length_m[begin + s]};
        const double stays = std::exp(-2.0 * length_m * double{part.field.extinction_per_m[begin + s]});
        length_bins[s] = length_m * bins_per_m;
        range_bin[s] = part.field.near_bin[begin + s] + 0.5 * length_bins[s];
        w[s] = transmittance * (1.0 - stays);
        transmittance *= stays;
      }
      const auto out = std::span(spread).subspan(begin, n);
      by_weight(w, range_bin, length_bins, out);
      for (float& d : out) d *= row_weight;
    }
  }
  // Σ_s (∂D/∂w_s) w_s is what a brightness of ∂D/∂w_s would return: its derivatives by extinction are those of D.
  SegmentSpans<float> segments = spans(part.batch);
  const std::vector<std::uint32_t> one_bin(part.batch.n_segments(), 0);
  segments.bin = one_bin;
  const double one = 1.0;
  const std::span<const double> gradient(&one, 1);
  integrate_adjoint(segments, {part.field.extinction_per_m, {}, spread, SourceForm::brightness}, Integrator::exact,
                    1, gradient, {d_extinction, {}, unused});
  for (std::size_t s = 0; s < d_extinction.size(); ++s) part.d_extinction[s] += d_extinction[s];
}

}  // namespace sarnerf
