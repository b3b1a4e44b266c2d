// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/integrate.h"

#include <cmath>
#include <vector>

#include "check_spans.h"

namespace sarnerf::oracle {
namespace {

/// Contribution c of one segment as a function of its optical depth x, for unit source and
/// transmittance: c = source · T · value(x), ∂c/∂x = source · T · slope(x).
struct Response {
  double value;
  double slope;
};

/// w(x) of c = P ℓ T w, and its derivative.
Response weight(Integrator integrator, double x) {
  const double e = std::exp(-x);
  switch (integrator) {
    case Integrator::exact: {
      if (x == 0.0) return {1.0, -0.5};
      const double w = -std::expm1(-x) / x;
      // (e − w)/x cancels for small x. There its series is used, with more terms than double precision needs.
      if (x < 0.5) {
        double slope = 0.0;
        double power = 1.0;  // (−x)ⁿ / n!
        for (int n = 0; n < 18; ++n) {
          slope -= power / (n + 2);
          power *= -x / (n + 1);
        }
        return {w, slope};
      }
      return {w, (e - w) / x};
    }
    case Integrator::midpoint: {
      const double half = std::exp(-0.5 * x);
      return {half, -0.5 * half};
    }
    case Integrator::paper:
      return {e, -e};
    case Integrator::paper_gated: {
      if (x == 0.0) return {1.0, -1.0};
      const double tanh_x = std::tanh(x);
      const double h = tanh_x / x;
      // h′ = (sech² − h)/x. Near 0 its Taylor series is used, with enough terms to be exact to rounding.
      const double h_slope = x < 0.01
                                 ? x * (-2.0 / 3.0 + x * x * (8.0 / 15.0 - x * x * 34.0 / 105.0))
                                 : (1.0 - tanh_x * tanh_x - h) / x;
      return {e * h, e * (h_slope - h)};
    }
  }
  return {};
}

/// x w(x) of c = γ T x w, and its derivative. Written out so that nothing overflows for large x.
Response absorptance(Integrator integrator, double x) {
  const double e = std::exp(-x);
  switch (integrator) {
    case Integrator::exact:
      return {-std::expm1(-x), e};
    case Integrator::midpoint: {
      const double half = std::exp(-0.5 * x);
      return half == 0.0 ? Response{} : Response{x * half, (1.0 - 0.5 * x) * half};
    }
    case Integrator::paper:
      return e == 0.0 ? Response{} : Response{x * e, (1.0 - x) * e};
    case Integrator::paper_gated: {
      const double tanh_x = std::tanh(x);
      return {e * tanh_x, e * (1.0 - tanh_x * tanh_x - tanh_x)};
    }
  }
  return {};
}

/// Neumaier's compensated sum, whose rounding error does not grow with its length: rays may have thousands of segments.
class CompensatedSum {
 public:
  void add(double term) {
    const double sum = sum_ + term;
    lost_ += std::abs(sum_) >= std::abs(term) ? (sum_ - sum) + term : (term - sum) + sum_;
    sum_ = sum;
  }
  double value() const { return sum_ + lost_; }

 private:
  double sum_ = 0.0, lost_ = 0.0;
};

/// Values and derivatives of one segment, from the arrays.
struct Segment {
  double length_m;
  double depth;            ///< x = ℓ (κ⁺ + κ⁻)
  double depth_per_forth;  ///< ∂x/∂κ⁺: 2ℓ when κ⁻ follows κ⁺
  double depth_per_back;   ///< ∂x/∂κ⁻
  double source;           ///< P or γ
  Response response;       ///< c = source · T · value
};

Segment segment_at(const SegmentSpans<double>& segments, const FieldSamples<double>& field,
                   Integrator integrator, std::size_t s) {
  Segment q{};
  q.length_m = segments.length_m[s];
  const double kappa_forth = field.extinction_per_m[s];
  const bool one_extinction = field.extinction_back_per_m.empty();
  const double kappa_back = one_extinction ? kappa_forth : field.extinction_back_per_m[s];
  q.depth = q.length_m * (kappa_forth + kappa_back);
  q.depth_per_forth = one_extinction ? 2.0 * q.length_m : q.length_m;
  q.depth_per_back = q.length_m;
  q.source = field.source[s];
  if (field.form == SourceForm::scattering) {
    const Response w = weight(integrator, q.depth);
    q.response = {q.length_m * w.value, q.length_m * w.slope};
  } else {
    q.response = absorptance(integrator, q.depth);
  }
  return q;
}

}  // namespace

void integrate(const SegmentSpans<double>& segments, const FieldSamples<double>& field,
               Integrator integrator, int n_range, std::span<double> pixels) {
  check_spans(segments, field, n_range, pixels.size());
  const auto n_bins = static_cast<std::size_t>(n_range);
  for (std::size_t ray = 0; ray < segments.ray_row.size(); ++ray) {
    CompensatedSum depth_before;
    for (std::size_t s = segments.ray_begin[ray]; s < segments.ray_begin[ray + 1]; ++s) {
      const Segment q = segment_at(segments, field, integrator, s);
      const double contribution = q.source * std::exp(-depth_before.value()) * q.response.value;
      depth_before.add(q.depth);
      if (segments.bin[s] < n_bins) {
        pixels[segments.ray_row[ray] * n_bins + segments.bin[s]] += contribution;
      }
    }
  }
}

void integrate_adjoint(const SegmentSpans<double>& segments, const FieldSamples<double>& field,
                       Integrator integrator, int n_range, std::span<const double> pixel_gradients,
                       const FieldGradients<double>& gradients) {
  check_spans(segments, field, n_range, pixel_gradients.size());
  check_gradients(field, gradients);
  const auto n_bins = static_cast<std::size_t>(n_range);
  std::vector<double> transmittance;  // [segments of one ray]
  for (std::size_t ray = 0; ray < segments.ray_row.size(); ++ray) {
    const std::size_t begin = segments.ray_begin[ray], end = segments.ray_begin[ray + 1];
    transmittance.resize(end - begin);
    CompensatedSum depth_before;
    for (std::size_t s = begin; s < end; ++s) {
      transmittance[s - begin] = std::exp(-depth_before.value());
      depth_before.add(segment_at(segments, field, integrator, s).depth);
    }
    // From far to near: Σ_{s′>s} g_{s′} c_{s′} grows by one term at each step.
    CompensatedSum behind;
    for (std::size_t s = end; s-- > begin;) {
      const Segment q = segment_at(segments, field, integrator, s);
      const double T = transmittance[s - begin];
      const double g = segments.bin[s] < n_bins
                           ? pixel_gradients[segments.ray_row[ray] * n_bins + segments.bin[s]]
                           : 0.0;
      const double by_depth = g * q.source * T * q.response.slope - behind.value();
      gradients.source[s] = g * T * q.response.value;
      gradients.extinction_per_m[s] = by_depth * q.depth_per_forth;
      if (!gradients.extinction_back_per_m.empty()) {
        gradients.extinction_back_per_m[s] = by_depth * q.depth_per_back;
      }
      behind.add(g * q.source * T * q.response.value);
    }
  }
}

}  // namespace sarnerf::oracle
