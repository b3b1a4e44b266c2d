// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sarnerf/mpa/integrator.h"
#include "sarnerf/mpa/sample_batch.h"

namespace sarnerf {

/// What the source term of a segment holds.
enum class SourceForm {
  scattering,  ///< P (1/m): thin media
  brightness,  ///< γ = P / (κ⁺ + κ⁻), dimensionless: opaque and dense matter, at any resolution
};

/// Values of the field at the segments. `extinction_back` may be empty: κ⁻ = κ⁺ then, without a second
/// array being read.
template <class T>
struct FieldSamples {
  std::span<const T> extinction_per_m;       ///< κ⁺ [n_segments], ≥ 0
  std::span<const T> extinction_back_per_m;  ///< κ⁻ [n_segments] or empty
  std::span<const T> source;                 ///< P or γ [n_segments], ≥ 0
  SourceForm form = SourceForm::scattering;
};

/// Derivatives of a loss by the field's samples, each as long as its counterpart.
template <class T>
struct FieldGradients {
  std::span<T> extinction_per_m;
  std::span<T> extinction_back_per_m;
  std::span<T> source;
};

/// Emission–absorption along rays (printed eqs. 6, 24; docs/equations.md):
///
///     pixel(row, j) += Σ_k Σ_{s in bin j} c_s,   c_s as in Integrator
///
/// `pixels` is [n_rows × n_range] row-major and is added to. β⁰ is this sum times r_j Δθ / Δr.
/// Vectorised float32; the instruction set is chosen at run time. Running optical depths and pixel sums
/// are kept in double. Cost: about a nanosecond a segment.
void integrate(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
               Integrator integrator, int n_range, std::span<double> pixels);

/// Adjoint of integrate(): given ∂L/∂pixel, writes (does not add) ∂L/∂κ⁺, ∂L/∂κ⁻ and ∂L/∂source.
/// Rays are independent, so disjoint ranges of rays may be given to different threads.
void integrate_adjoint(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                       Integrator integrator, int n_range, std::span<const double> pixel_gradients,
                       const FieldGradients<float>& gradients);

/// Instruction sets that integrate() and integrate_adjoint() are compiled for.
enum class InstructionSet { baseline, avx2, avx512 };

/// The best one that this processor has.
InstructionSet best_instruction_set();
std::string_view name(InstructionSet set);

/// The same with the instruction set given: for tests and benchmarks. The processor must have it.
void integrate(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
               Integrator integrator, int n_range, std::span<double> pixels, InstructionSet set);
void integrate_adjoint(const SegmentSpans<float>& segments, const FieldSamples<float>& field,
                       Integrator integrator, int n_range, std::span<const double> pixel_gradients,
                       const FieldGradients<float>& gradients, InstructionSet set);

}  // namespace sarnerf
