// SPDX-License-Identifier: Apache-2.0
// The kernels for one instruction set. CMake compiles this file once for each set, with the compiler's options for it and
// its name as SARNERF_KERNEL_NAMESPACE. Everything has internal linkage except the three entry points at the end.

#include <cstdint>

#include "kernel.h"
#include "sarnerf/mpa/integrate.h"

/// Elementary functions of the kernels. They have no branches and no calls, so that the loops around them are
/// vectorised. They are in double, so that neither overflow nor cancellation is a concern. The polynomials are only
/// as long as float32 results need: each is a minimax fit whose stated relative error is a hundredth to a tenth of a
/// float32 rounding. Internal linkage: see kernel.h.
namespace sarnerf {
namespace {

/// Optical depth from which a transmittance is 0: the largest product P ℓ of float32 numbers, 1.2e77, times e^−266
/// is below the smallest normal float32 number. Up to this depth no product is denormal in double, which would be slow.
constexpr double kOpaqueDepth = 266.0;

/// e^−x for x ≥ 0, relative error 2.0e-9; exactly 1 at 0, exactly 0 from kOpaqueDepth on.
inline double exp_minus(double x) {
  // Adding 1.5 · 2⁵² rounds to an integer, which is then in the low bits.
  constexpr double kRound = 0x1.8p52;
  constexpr double kLog2OfE = 1.4426950408889634;
  constexpr double kLnOf2 = 0.6931471805599453;
  const double bounded = x < kOpaqueDepth ? x : kOpaqueDepth;
  const double shifted = kRound - bounded * kLog2OfE;
  const double n = shifted - kRound;
  const double r = -bounded - n * kLnOf2;  // |r| ≤ ln(2)/2
  double p = 0.0013843641977724286;
  p = p * r + 0.0083741632754035379;
  p = p * r + 0.04166800261343754;
  p = p * r + 0.16666431171668285;
  p = p * r + 0.4999999420539519;
  p = p * r + 1.0000000321832574;
  p = p * r + 1.0;
  const std::int64_t exponent = (__builtin_bit_cast(std::int64_t, shifted) + 1023) << 52;
  const double result = p * __builtin_bit_cast(double, exponent);
  return x < kOpaqueDepth ? result : 0.0;
}

/// (1 − e^−x)/x for 0 ≤ x ≤ 1, relative error 2.7e-9; exactly 1 at 0.
inline double mean_transmittance(double x) {
  double p = 0.00012913100082119869;
  p = p * x - 0.0013011266983935751;
  p = p * x + 0.0082762089649687648;
  p = p * x - 0.041647468411462333;
  p = p * x + 0.16666365623896958;
  p = p * x - 0.4999998405556977;
  return p * x + 1.0;
}

/// Derivative of (1 − e^−x)/x for 0 ≤ x ≤ 1, relative error 5.2e-9.
inline double mean_transmittance_slope(double x) {
  double p = -0.00011189153672002885;
  p = p * x + 0.0011118450166727378;
  p = p * x - 0.0068928576864700868;
  p = p * x + 0.033315819596103072;
  p = p * x - 0.12499721788477114;
  p = p * x + 0.33333318345925889;
  return p * x - 0.5;
}

/// tanh(x)/x for 0 ≤ x ≤ 1/2 as a function of x², relative error 3.5e-10.
inline double tanh_ratio(double x_squared) {
  double p = -0.0066474883300747703;
  p = p * x_squared + 0.021297991570912092;
  p = p * x_squared - 0.053899190626084191;
  p = p * x_squared + 0.13332964257415106;
  p = p * x_squared - 0.33333326882077507;
  return p * x_squared + 1.0;
}

/// (d/dx tanh(x)/x)/x for 0 ≤ x ≤ 1/2 as a function of x², relative error 3.1e-9.
inline double tanh_ratio_slope(double x_squared) {
  double p = 0.030793770101420079;
  p = p * x_squared - 0.085470036902777241;
  p = p * x_squared + 0.17457306777009989;
  p = p * x_squared - 0.32378894945590365;
  p = p * x_squared + 0.53333297026844658;
  return p * x_squared - 0.66666666666666667;
}

}  // namespace
}  // namespace sarnerf

namespace sarnerf {

namespace {

/// Contribution of a segment c = source · value and its derivative by the segment's own optical depth,
/// ∂c/∂x = source · slope; the transmittance in front is part of both.
struct Response {
  double value;
  double slope;
};

/// Response of a segment of length ℓ and optical depth x behind the optical depth τ. `kBrightness`: the source is γ
/// instead of P, and x replaces ℓ (docs/method/equations.md, E1). The compiler removes a result that is not used.
///
/// Thick segments take differences of transmittances. Thin ones, where these would cancel, take polynomials. Both are
/// computed, and the discarded one may overflow. x² cannot: x < 10⁷⁸ for all float32 lengths and extinctions.
template <Integrator kIntegrator, bool kBrightness>
inline Response respond(double l, double x, double tau) {
  if constexpr (kIntegrator == Integrator::exact) {
    const double t_in = exp_minus(tau), t_out = exp_minus(tau + x);
    const bool thin = x < 1.0;
    if constexpr (kBrightness) {
      return {thin ? t_in * (x * mean_transmittance(x)) : t_in - t_out, t_out};
    } else {
      const double x_or_1 = thin ? 1.0 : x;
      const double thick_value = (t_in - t_out) / x_or_1;
      const double thick_slope = (t_out * (1.0 + x) - t_in) / (x_or_1 * x_or_1);
      return {l * (thin ? t_in * mean_transmittance(x) : thick_value),
              l * (thin ? t_in * mean_transmittance_slope(x) : thick_slope)};
    }
  } else if constexpr (kIntegrator == Integrator::midpoint) {
    const double t = exp_minus(tau + 0.5 * x);
    if constexpr (kBrightness) return {t * x, t * (1.0 - 0.5 * x)};
    return {t * l, t * (-0.5 * l)};
  } else if constexpr (kIntegrator == Integrator::paper) {
    const double t = exp_minus(tau + x);
    if constexpr (kBrightness) return {t * x, t * (1.0 - x)};
    return {t * l, t * -l};
  } else {
    const double t = exp_minus(tau + x), e2 = exp_minus(2.0 * x);
    const bool thin = x < 0.5;
    const double thick_tanh = (1.0 - e2) / (1.0 + e2);
    if constexpr (kBrightness) {
      const double tanh_x = thin ? x * tanh_ratio(x * x) : thick_tanh;
      return {t * tanh_x, t * (1.0 - tanh_x * tanh_x - tanh_x)};
    } else {
      const double x_or_1 = thin ? 1.0 : x;
      const double thick_ratio = thick_tanh / x_or_1;
      const double thick_slope = (1.0 - thick_tanh * thick_tanh - thick_ratio) / x_or_1;
      const double ratio = thin ? tanh_ratio(x * x) : thick_ratio;
      const double slope = thin ? x * tanh_ratio_slope(x * x) : thick_slope;
      return {l * (t * ratio), l * (t * (slope - ratio))};
    }
  }
}

}  // namespace

namespace {

constexpr float kLargestFloat = 3.402823466e38f;

/// Clamps a gradient to the range of float32: an infinite one would corrupt the optimiser's state.
inline float saturate(double value) {
  constexpr double kLargest = kLargestFloat;
  const double below = value < kLargest ? value : kLargest;
  return static_cast<float>(below > -kLargest ? below : -kLargest);
}

/// x = ℓ (κ⁺ + κ⁻) in double: exact for one extinction, and not limited to the range of float32.
void optical_depths(const float* __restrict l, const float* __restrict kappa_forth,
                    const float* __restrict kappa_back, std::size_t n, double* __restrict x) {
  if (kappa_back) {
    for (std::size_t s = 0; s < n; ++s) {
      x[s] = double{l[s]} * (double{kappa_forth[s]} + double{kappa_back[s]});
    }
  } else {
    for (std::size_t s = 0; s < n; ++s) x[s] = double{l[s]} * (2.0 * double{kappa_forth[s]});
  }
}

/// τ_s = Σ_{s′<s} x_{s′}, four at a time: the chain of dependent additions limits this loop, and is a quarter as
/// long. The order is fixed, so every instruction set gives the same bits.
void sums_before(const double* __restrict x, std::size_t n, double* __restrict tau) {
  double sum = 0.0;
  std::size_t s = 0;
  for (; s + 4 <= n; s += 4) {
    const double first_two = x[s] + x[s + 1];
    const double last_two = x[s + 2] + x[s + 3];
    tau[s] = sum;
    tau[s + 1] = sum + x[s];
    tau[s + 2] = sum + first_two;
    tau[s + 3] = sum + (first_two + x[s + 2]);
    sum += first_two + last_two;
  }
  for (; s < n; ++s) {
    tau[s] = sum;
    sum += x[s];
  }
}

/// In place: q_s becomes Σ_{s′>s} q_{s′}, four at a time as in sums_before().
void sums_behind(std::size_t n, double* q) {
  double sum = 0.0;
  std::size_t s = n;
  for (; s >= 4; s -= 4) {
    const double q0 = q[s - 4], q1 = q[s - 3], q2 = q[s - 2], q3 = q[s - 1];
    const double last_two = q2 + q3;
    q[s - 1] = sum;
    q[s - 2] = sum + q3;
    q[s - 3] = sum + last_two;
    q[s - 4] = sum + (q1 + last_two);
    sum += (q0 + q1) + last_two;
  }
  for (; s > 0; --s) {
    const double own = q[s - 1];
    q[s - 1] = sum;
    sum += own;
  }
}

/// End of the block of whole rays that begins with `ray`.
std::size_t block_end(const KernelInput& in, std::size_t ray) {
  const std::size_t limit = in.ray_begin[ray] + kBlockSegments;
  std::size_t end = ray + 1;
  while (end < in.n_rays && in.ray_begin[end + 1] <= limit) ++end;
  return end;
}

/// Optical depth x of each segment of a block, and optical depth τ of the segments before it on its ray.
void block_depths(const KernelInput& in, std::size_t ray, std::size_t end_ray, double* x,
                  double* tau) {
  const std::size_t begin = in.ray_begin[ray], n = in.ray_begin[end_ray] - begin;
  const float* back = in.extinction_back_per_m;
  optical_depths(in.length_m + begin, in.extinction_per_m + begin, back ? back + begin : back, n,
                 x);
  for (std::size_t q = ray; q < end_ray; ++q) {
    const std::size_t s = in.ray_begin[q] - begin;
    sums_before(x + s, in.ray_begin[q + 1] - in.ray_begin[q], tau + s);
  }
}

template <Integrator kIntegrator, bool kBrightness>
void contributions(const float* __restrict l, const float* __restrict source,
                   const double* __restrict x, const double* __restrict tau, std::size_t n,
                   double* __restrict c) {
  for (std::size_t s = 0; s < n; ++s) {
    c[s] = double{source[s]} * respond<kIntegrator, kBrightness>(double{l[s]}, x[s], tau[s]).value;
  }
}

/// Calls sink(first ray, end ray, first segment, contributions of the segments) for blocks of whole rays.
template <Integrator kIntegrator, bool kBrightness, class Sink>
void forward(const KernelInput& in, std::size_t stride, double* scratch, const Sink& sink) {
  double* const x = scratch;
  double* const tau = x + stride;
  double* const c = tau + stride;
  for (std::size_t ray = 0; ray < in.n_rays;) {
    const std::size_t end_ray = block_end(in, ray);
    const std::size_t begin = in.ray_begin[ray], n = in.ray_begin[end_ray] - begin;
    block_depths(in, ray, end_ray, x, tau);
    contributions<kIntegrator, kBrightness>(in.length_m + begin, in.source + begin, x, tau, n, c);
    sink(ray, end_ray, begin, c);
    ray = end_ray;
  }
}

/// Adds contributions to their pixels.
struct PixelSink {
  const KernelInput& in;
  double* pixels;
  void operator()(std::size_t ray, std::size_t end_ray, std::size_t begin, const double* c) const {
    for (; ray < end_ray; ++ray) {
      double* const row = pixels + in.ray_row[ray] * in.n_range;
      for (std::size_t s = in.ray_begin[ray]; s < in.ray_begin[ray + 1]; ++s) {
        if (in.bin[s] < in.n_range) row[in.bin[s]] += c[s - begin];
      }
    }
  }
};

/// Writes contributions to an array of segments.
struct SegmentSink {
  const KernelInput& in;
  double* contributions;
  void operator()(std::size_t, std::size_t end_ray, std::size_t begin, const double* c) const {
    const std::size_t first = in.ray_begin[0], n = in.ray_begin[end_ray] - begin;
    for (std::size_t s = 0; s < n; ++s) contributions[begin - first + s] = c[s];
  }
};

/// In: pixel gradients g, depths x and τ. Out: x holds g ∂c/∂x, τ holds g c, and `by_source` ∂L/∂source.
template <Integrator kIntegrator, bool kBrightness>
void local_gradients(const float* __restrict l, const float* __restrict source,
                     const double* __restrict g, std::size_t n, double* __restrict x,
                     double* __restrict tau, float* __restrict by_source) {
  for (std::size_t s = 0; s < n; ++s) {
    const Response r = respond<kIntegrator, kBrightness>(double{l[s]}, x[s], tau[s]);
    const double weighted = g[s] * double{source[s]};
    by_source[s] = saturate(g[s] * r.value);
    tau[s] = weighted * r.value;
    x[s] = weighted * r.slope;
  }
}

void extinction_gradients(const float* __restrict l, const double* __restrict own,
                          const double* __restrict behind, double depths_per_length, std::size_t n,
                          float* __restrict by_extinction) {
  for (std::size_t s = 0; s < n; ++s) {
    by_extinction[s] = saturate(depths_per_length * double{l[s]} * (own[s] - behind[s]));
  }
}

template <Integrator kIntegrator, bool kBrightness>
void adjoint(const KernelInput& in, std::size_t stride, double* scratch,
             const double* pixel_gradients, const KernelGradients& out) {
  double* const x = scratch;
  double* const tau = x + stride;
  double* const g = tau + stride;
  const bool two_extinctions = in.extinction_back_per_m != nullptr;
  for (std::size_t ray = 0; ray < in.n_rays;) {
    const std::size_t end_ray = block_end(in, ray);
    const std::size_t begin = in.ray_begin[ray], n = in.ray_begin[end_ray] - begin;
    block_depths(in, ray, end_ray, x, tau);
    for (std::size_t q = ray; q < end_ray; ++q) {
      const double* const row = pixel_gradients + in.ray_row[q] * in.n_range;
      for (std::size_t s = in.ray_begin[q]; s < in.ray_begin[q + 1]; ++s) {
        g[s - begin] = in.bin[s] < in.n_range ? row[in.bin[s]] : 0.0;
      }
    }
    local_gradients<kIntegrator, kBrightness>(in.length_m + begin, in.source + begin, g, n, x, tau,
                                              out.source + begin);
    for (; ray < end_ray; ++ray) {
      sums_behind(in.ray_begin[ray + 1] - in.ray_begin[ray], tau + (in.ray_begin[ray] - begin));
    }
    extinction_gradients(in.length_m + begin, x, tau, two_extinctions ? 1.0 : 2.0, n,
                         out.extinction_per_m + begin);
    if (two_extinctions) {
      extinction_gradients(in.length_m + begin, x, tau, 1.0, n, out.extinction_back_per_m + begin);
    }
  }
}

template <Integrator kIntegrator, class Sink>
void forward_in_form(const KernelInput& in, std::size_t stride, double* scratch, const Sink& sink) {
  in.brightness_form ? forward<kIntegrator, true>(in, stride, scratch, sink)
                     : forward<kIntegrator, false>(in, stride, scratch, sink);
}

template <class Sink>
void forward_with(const KernelInput& in, std::size_t stride, double* scratch, const Sink& sink) {
  switch (in.integrator) {
    case Integrator::exact:
      return forward_in_form<Integrator::exact>(in, stride, scratch, sink);
    case Integrator::midpoint:
      return forward_in_form<Integrator::midpoint>(in, stride, scratch, sink);
    case Integrator::paper:
      return forward_in_form<Integrator::paper>(in, stride, scratch, sink);
    case Integrator::paper_gated:
      return forward_in_form<Integrator::paper_gated>(in, stride, scratch, sink);
  }
}

template <Integrator kIntegrator>
void adjoint_in_form(const KernelInput& in, std::size_t stride, double* scratch,
                     const double* pixel_gradients, const KernelGradients& out) {
  in.brightness_form ? adjoint<kIntegrator, true>(in, stride, scratch, pixel_gradients, out)
                     : adjoint<kIntegrator, false>(in, stride, scratch, pixel_gradients, out);
}

}  // namespace

namespace SARNERF_KERNEL_NAMESPACE {

void integrate(const KernelInput& in, std::size_t stride, double* scratch, double* pixels) {
  forward_with(in, stride, scratch, PixelSink{in, pixels});
}

void contributions(const KernelInput& in, std::size_t stride, double* scratch, double* out) {
  forward_with(in, stride, scratch, SegmentSink{in, out});
}

void integrate_adjoint(const KernelInput& in, std::size_t stride, double* scratch, const double* g,
                       const KernelGradients& out) {
  switch (in.integrator) {
    case Integrator::exact:
      return adjoint_in_form<Integrator::exact>(in, stride, scratch, g, out);
    case Integrator::midpoint:
      return adjoint_in_form<Integrator::midpoint>(in, stride, scratch, g, out);
    case Integrator::paper:
      return adjoint_in_form<Integrator::paper>(in, stride, scratch, g, out);
    case Integrator::paper_gated:
      return adjoint_in_form<Integrator::paper_gated>(in, stride, scratch, g, out);
  }
}

}  // namespace SARNERF_KERNEL_NAMESPACE

}  // namespace sarnerf
