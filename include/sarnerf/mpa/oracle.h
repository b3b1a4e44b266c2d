// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/mpa/integrate.h"

/// Scalar double-precision reference for everything in integrate.h: written to be read and checked
/// against the equations, not to be fast. Tests compare the vectorised kernels with it.
namespace sarnerf::oracle {

void integrate(const SegmentSpans<double>& segments, const FieldSamples<double>& field,
               Integrator integrator, int n_range, std::span<double> pixels);

void integrate_adjoint(const SegmentSpans<double>& segments, const FieldSamples<double>& field,
                       Integrator integrator, int n_range, std::span<const double> pixel_gradients,
                       const FieldGradients<double>& gradients);

}  // namespace sarnerf::oracle
