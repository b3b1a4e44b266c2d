// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/integrate.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "check_spans.h"
#include "kernel.h"
#include "sarnerf/core/error.h"

namespace sarnerf {

void SampleBatch::clear() {
  ray_begin.assign(1, 0);
  ray_row.clear();
  ray_elevation.clear();
  ray_direction.clear();
  bin.clear();
  length_m.clear();
  point_m.clear();
}

SegmentSpans<float> spans(const SampleBatch& batch) {
  return {batch.ray_begin, batch.ray_row, batch.bin, batch.length_m};
}

namespace {

constexpr std::array<std::pair<Integrator, std::string_view>, 4> kNames{{
    {Integrator::exact, "exact"},
    {Integrator::midpoint, "midpoint"},
    {Integrator::paper, "paper"},
    {Integrator::paper_gated, "paper-gated"},
}};

}  // namespace

std::string_view name(Integrator integrator) {
  for (const auto& [value, text] : kNames) {
    if (value == integrator) return text;
  }
  return "unknown";
}

Integrator integrator_from_name(std::string_view name) {
  std::string known;
  for (const auto& [value, text] : kNames) {
    if (text == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw UsageError("unknown integrator '" + std::string(name) + "'; choose one of " + known);
}

namespace {

KernelInput kernel_input(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                         Integrator integrator, int n_range) {
  return {segments.ray_begin.data(),
          segments.ray_row.data(),
          segments.bin.data(),
          segments.length_m.data(),
          field.extinction_per_m.data(),
          field.extinction_back_per_m.empty() ? nullptr : field.extinction_back_per_m.data(),
          field.source.data(),
          segments.ray_row.size(),
          static_cast<std::size_t>(n_range),
          integrator,
          field.form == SourceForm::brightness};
}

/// Segments of the longest block, in whole cache lines.
std::size_t scratch_stride(const SegmentSpans<float>& segments) {
  std::size_t longest =
      std::min<std::size_t>(kBlockSegments, segments.ray_begin.back() - segments.ray_begin.front());
  for (std::size_t ray = 0; ray < segments.ray_row.size(); ++ray) {
    longest = std::max<std::size_t>(longest, segments.ray_begin[ray + 1] - segments.ray_begin[ray]);
  }
  return (longest + 7) / 8 * 8;
}

void expect_available(InstructionSet set) {
  if (set > best_instruction_set()) {
    throw UsageError("this processor, or this build, has no " + std::string(name(set)) +
                     " kernels; the best one is " + std::string(name(best_instruction_set())));
  }
}

}  // namespace

InstructionSet best_instruction_set() {
#ifdef SARNERF_X86_KERNELS
  static const InstructionSet best = [] {
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
      return InstructionSet::baseline;
    }
    const bool has_512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                         __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
    return has_512 ? InstructionSet::avx512 : InstructionSet::avx2;
  }();
  return best;
#else
  return InstructionSet::baseline;
#endif
}

std::string_view name(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline:
      return "baseline";
    case InstructionSet::avx2:
      return "avx2";
    case InstructionSet::avx512:
      return "avx512";
  }
  return "unknown";
}

void integrate(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
               Integrator integrator, int n_range, std::span<double> pixels, InstructionSet set) {
  expect_available(set);
  check_spans(segments, field, n_range, pixels.size());
  const KernelInput in = kernel_input(segments, field, integrator, n_range);
  const std::size_t stride = scratch_stride(segments);
  std::vector<double> scratch(kScratchArrays * stride);
  switch (set) {
    case InstructionSet::baseline:
      return kernel_baseline::integrate(in, stride, scratch.data(), pixels.data());
#ifdef SARNERF_X86_KERNELS
    case InstructionSet::avx2:
      return kernel_avx2::integrate(in, stride, scratch.data(), pixels.data());
    case InstructionSet::avx512:
      return kernel_avx512::integrate(in, stride, scratch.data(), pixels.data());
#else
    default:
      return;
#endif
  }
}

void contributions(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                   Integrator integrator, std::span<double> out, InstructionSet set) {
  expect_available(set);
  check_segments(segments, field);
  expect_length(out.size(), segments.ray_begin.back() - segments.ray_begin.front(),
                "the array of contributions");
  const KernelInput in = kernel_input(segments, field, integrator, 0);
  const std::size_t stride = scratch_stride(segments);
  std::vector<double> scratch(kScratchArrays * stride);
  switch (set) {
    case InstructionSet::baseline:
      return kernel_baseline::contributions(in, stride, scratch.data(), out.data());
#ifdef SARNERF_X86_KERNELS
    case InstructionSet::avx2:
      return kernel_avx2::contributions(in, stride, scratch.data(), out.data());
    case InstructionSet::avx512:
      return kernel_avx512::contributions(in, stride, scratch.data(), out.data());
#else
    default:
      return;
#endif
  }
}

void integrate_adjoint(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                       Integrator integrator, int n_range, std::span<const double> pixel_gradients,
                       const FieldGradients<float>& gradients, InstructionSet set) {
  expect_available(set);
  check_spans(segments, field, n_range, pixel_gradients.size());
  check_gradients(field, gradients);
  const KernelInput in = kernel_input(segments, field, integrator, n_range);
  const KernelGradients out{
      gradients.extinction_per_m.data(),
      in.extinction_back_per_m ? gradients.extinction_back_per_m.data() : nullptr,
      gradients.source.data()};
  const std::size_t stride = scratch_stride(segments);
  std::vector<double> scratch(kScratchArrays * stride);
  switch (set) {
    case InstructionSet::baseline:
      return kernel_baseline::integrate_adjoint(in, stride, scratch.data(), pixel_gradients.data(),
                                                out);
#ifdef SARNERF_X86_KERNELS
    case InstructionSet::avx2:
      return kernel_avx2::integrate_adjoint(in, stride, scratch.data(), pixel_gradients.data(),
                                            out);
    case InstructionSet::avx512:
      return kernel_avx512::integrate_adjoint(in, stride, scratch.data(), pixel_gradients.data(),
                                              out);
#else
    default:
      return;
#endif
  }
}

void integrate(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
               Integrator integrator, int n_range, std::span<double> pixels) {
  integrate(segments, field, integrator, n_range, pixels, best_instruction_set());
}

void integrate_adjoint(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                       Integrator integrator, int n_range, std::span<const double> pixel_gradients,
                       const FieldGradients<float>& gradients) {
  integrate_adjoint(segments, field, integrator, n_range, pixel_gradients, gradients,
                    best_instruction_set());
}

void contributions(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                   Integrator integrator, std::span<double> out) {
  contributions(segments, field, integrator, out, best_instruction_set());
}

}  // namespace sarnerf
