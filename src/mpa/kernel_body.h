// SPDX-License-Identifier: Apache-2.0
// The kernels, compiled once for each instruction set: kernel_<set>.cpp defines
// SARNERF_KERNEL_NAMESPACE and includes this file. Only internal linkage but for the two entry points.

#include "kernel.h"
#include "kernel_response.h"

namespace sarnerf {
namespace {

constexpr float kLargestFloat = 3.402823466e38f;

/// Gradients that float32 cannot hold saturate: an infinite one would poison the optimiser's state.
inline float saturate(double value) {
  constexpr double kLargest = kLargestFloat;
  const double below = value < kLargest ? value : kLargest;
  return static_cast<float>(below > -kLargest ? below : -kLargest);
}

/// x = ℓ (κ⁺ + κ⁻): exact in double, and beyond the range of float32 where need be.
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

/// τ_s = Σ_{s′<s} x_{s′}. By fours: the chain of additions that depend on each other is what limits this
/// loop, and is a quarter as long. The order is fixed, so every instruction set gives the same bits.
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

/// In place: q_s becomes Σ_{s′>s} q_{s′}. By fours as in sums_before().
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

/// Optical depths of a block's segments and of what lies before each.
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

/// Leaves contributions as they are.
struct SegmentSink {
  const KernelInput& in;
  double* contributions;
  void operator()(std::size_t, std::size_t end_ray, std::size_t begin, const double* c) const {
    const std::size_t first = in.ray_begin[0], n = in.ray_begin[end_ray] - begin;
    for (std::size_t s = 0; s < n; ++s) contributions[begin - first + s] = c[s];
  }
};

/// In: pixel gradients g, depths x and τ. Out: x holds g ∂c/∂x, τ holds g c, and ∂L/∂source is done.
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
