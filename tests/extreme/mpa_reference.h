// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include "../mpa/random_batch.h"
#include "quad.h"

/// Equation E1 of docs/method/equations.md in quadruple precision, written a second time: no code is shared with the
/// library's oracle, which it judges as well.
namespace sarnerf::test {

constexpr double kLargestFloat = std::numeric_limits<float>::max();

/// c of one segment for unit source and transmittance.
inline Quad response(Integrator integrator, SourceForm form, Quad length, Quad x) {
  const Quad per_source = form == SourceForm::brightness ? x : length;
  switch (integrator) {
    case Integrator::exact:
      if (form == SourceForm::brightness) return -quad_expm1(-x);
      return x == 0 ? length : length * -quad_expm1(-x) / x;
    case Integrator::midpoint:
      return per_source * quad_exp(-x / 2);
    case Integrator::paper:
      return per_source * quad_exp(-x);
    case Integrator::paper_gated:
      if (form == SourceForm::brightness) return quad_exp(-x) * quad_tanh(x);
      return x == 0 ? length : length * quad_exp(-x) * quad_tanh(x) / x;
  }
  return 0;
}

/// d/dx (1 − e^−x)/x.
inline Quad mean_transmittance_slope(Quad x) {
  if (x > 1) return (quad_exp(-x) * (1 + x) - 1) / (x * x);
  Quad sum = 0, power = 1;  // (−x)ⁿ/(n + 2)! (n + 1)
  for (int n = 0; n < 35; ++n) {
    sum -= power * (n + 1) / (n + 2);
    power *= -x / (n + 2);
  }
  return sum;
}

/// d/dx tanh(x)/x.
inline Quad tanh_ratio_slope(Quad x) {
  if (x > Quad(1e-3)) {
    const Quad e = quad_exp(-2 * x), cosh = (1 + e) * (1 + e);
    return (4 * e / cosh - quad_tanh(x) / x) / x;
  }
  // Bernoulli's series; the next term is below 1e-33 of the first.
  const Quad y = x * x;
  return x * (Quad(-2) / 3 + y * (Quad(8) / 15 + y * (Quad(-102) / 315 + y * (Quad(496) / 2835 - y * Quad(13820) / 155925))));
}

/// ∂/∂x of response().
inline Quad response_slope(Integrator integrator, SourceForm form, Quad length, Quad x) {
  const bool brightness = form == SourceForm::brightness;
  const Quad e = quad_exp(-x), half = quad_exp(-x / 2);
  switch (integrator) {
    case Integrator::exact:
      return brightness ? e : length * mean_transmittance_slope(x);
    case Integrator::midpoint:
      return brightness ? (1 - x / 2) * half : -length / 2 * half;
    case Integrator::paper:
      return brightness ? (1 - x) * e : -length * e;
    case Integrator::paper_gated: {
      const Quad t = quad_tanh(x), sech_squared = 4 * e * e / ((1 + e * e) * (1 + e * e));
      if (brightness) return e * (sech_squared - t);
      return length * e * (tanh_ratio_slope(x) - (x == 0 ? Quad(1) : t / x));
    }
  }
  return 0;
}

inline Quad two_way_depth(const Problem<float>& p, std::size_t s) {
  const Quad forth = p.extinction[s];
  const Quad back = p.extinction_back.empty() ? forth : Quad(p.extinction_back[s]);
  return Quad(p.length_m[s]) * (forth + back);
}

/// What one segment gives and how it depends on its own depth.
struct ReferenceSegment {
  Quad depth = 0, before = 0;  ///< x, and Σ x in front
  Quad transmittance = 1, value = 0;
  Quad contribution = 0;
  Quad slope = 0;  ///< ∂ value/∂x, if asked for
};

inline std::vector<ReferenceSegment> reference_segments(const Problem<float>& p, Integrator integrator,
                                                        bool with_slopes) {
  std::vector<ReferenceSegment> all(p.n_segments());
  for (std::size_t ray = 0; ray < p.ray_row.size(); ++ray) {
    Quad before = 0;
    for (std::size_t s = p.ray_begin[ray]; s < p.ray_begin[ray + 1]; ++s) {
      ReferenceSegment& q = all[s];
      const Quad length = p.length_m[s];
      q.depth = two_way_depth(p, s);
      q.before = before;
      q.transmittance = quad_exp(-before);
      q.value = response(integrator, p.form, length, q.depth);
      q.contribution = Quad(p.source[s]) * q.transmittance * q.value;
      before += q.depth;
      if (with_slopes) q.slope = response_slope(integrator, p.form, length, q.depth);
    }
  }
  return all;
}

inline bool in_image(const Problem<float>& p, std::size_t s) {
  return p.bin[s] < static_cast<std::uint32_t>(p.n_range);
}

inline std::size_t pixel_of(const Problem<float>& p, std::size_t ray, std::size_t s) {
  return std::size_t{p.ray_row[ray]} * static_cast<std::size_t>(p.n_range) + p.bin[s];
}

inline std::vector<Quad> reference_pixels(const Problem<float>& p, Integrator integrator) {
  const std::vector<ReferenceSegment> segments = reference_segments(p, integrator, false);
  std::vector<Quad> pixels(p.n_pixels(), Quad(0));
  for (std::size_t ray = 0; ray < p.ray_row.size(); ++ray) {
    for (std::size_t s = p.ray_begin[ray]; s < p.ray_begin[ray + 1]; ++s) {
      if (in_image(p, s)) pixels[pixel_of(p, ray, s)] += segments[s].contribution;
    }
  }
  return pixels;
}

/// Derivatives of Σ g · pixel, and for those by depth the size of the terms of which they are the difference.
struct ReferenceGradients {
  std::vector<Quad> by_source, by_depth, size_by_depth;
};

inline ReferenceGradients reference_gradients(const Problem<float>& p, Integrator integrator,
                                              const std::vector<double>& g) {
  const std::vector<ReferenceSegment> segments = reference_segments(p, integrator, true);
  const std::size_t n = p.n_segments();
  ReferenceGradients out{std::vector<Quad>(n), std::vector<Quad>(n), std::vector<Quad>(n)};
  for (std::size_t ray = 0; ray < p.ray_row.size(); ++ray) {
    Quad behind = 0, size_behind = 0;
    for (std::size_t s = p.ray_begin[ray + 1]; s-- > p.ray_begin[ray];) {
      const ReferenceSegment& q = segments[s];
      const Quad weight = in_image(p, s) ? Quad(g[pixel_of(p, ray, s)]) : Quad(0);
      const Quad own = weight * Quad(p.source[s]) * q.transmittance * q.slope;
      out.by_source[s] = weight * q.transmittance * q.value;
      out.by_depth[s] = own - behind;
      out.size_by_depth[s] = quad_abs(own) + size_behind;
      behind += weight * q.contribution;
      size_behind += quad_abs(weight * q.contribution);
    }
  }
  return out;
}

}  // namespace sarnerf::test
