// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "sarnerf/mpa/integrate.h"

/// Interface between integrate.cpp and the kernels. Kernels are compiled for instruction sets that this
/// processor may not have. The two sides share no inline function, because the linker keeps one copy of
/// each, and might keep the wrong one. Hence plain pointers, and no standard containers.
namespace sarnerf {

/// Rays of one call; shapes as in SegmentSpans and FieldSamples.
struct KernelInput {
  const std::uint32_t* ray_begin;
  const std::uint32_t* ray_row;
  const std::uint32_t* bin;
  const float* length_m;
  const float* extinction_per_m;
  const float* extinction_back_per_m;  ///< null: κ⁻ = κ⁺
  const float* source;
  std::size_t n_rays;
  std::size_t n_range;
  Integrator integrator;
  bool brightness_form;
};

struct KernelGradients {
  float* extinction_per_m;
  float* extinction_back_per_m;  ///< null where KernelInput's is
  float* source;
};

/// Rays are processed in blocks of at most this many segments, whose intermediate results stay in the first
/// level cache. A ray is never split: a longer one is a block of its own.
inline constexpr std::size_t kBlockSegments = 512;

/// Intermediate arrays of doubles that a kernel needs, each as long as the longest block.
inline constexpr std::size_t kScratchArrays = 3;

namespace kernel_baseline {
void integrate(const KernelInput& in, std::size_t stride, double* scratch, double* pixels);
void contributions(const KernelInput& in, std::size_t stride, double* scratch, double* out);
void integrate_adjoint(const KernelInput& in, std::size_t stride, double* scratch,
                       const double* pixel_gradients, const KernelGradients& out);
}  // namespace kernel_baseline

#ifdef SARNERF_X86_KERNELS
namespace kernel_avx2 {
void integrate(const KernelInput& in, std::size_t stride, double* scratch, double* pixels);
void contributions(const KernelInput& in, std::size_t stride, double* scratch, double* out);
void integrate_adjoint(const KernelInput& in, std::size_t stride, double* scratch,
                       const double* pixel_gradients, const KernelGradients& out);
}  // namespace kernel_avx2

namespace kernel_avx512 {
void integrate(const KernelInput& in, std::size_t stride, double* scratch, double* pixels);
void contributions(const KernelInput& in, std::size_t stride, double* scratch, double* out);
void integrate_adjoint(const KernelInput& in, std::size_t stride, double* scratch,
                       const double* pixel_gradients, const KernelGradients& out);
}  // namespace kernel_avx512
#endif

}  // namespace sarnerf
