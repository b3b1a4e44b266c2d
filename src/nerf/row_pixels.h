// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "row_part.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// β⁰ of one of the part's rows from the field's values at its segments: emission and absorption along rays
/// (mpa::integrate), times r_j Δθ / Δr.
/// `pixels` [n_range].
void row_pixels(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                Integrator integrator, const RaySampling& sampling, std::span<float> pixels);

/// Its adjoint: writes the row's share of part.d_extinction and part.d_source, arrays over all segments.
void row_pixels_adjoint(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                        Integrator integrator, const RaySampling& sampling,
                        std::span<const float> pixel_gradients);

}  // namespace sarnerf
