// SPDX-License-Identifier: Apache-2.0
#include "row_pixels.h"

namespace sarnerf {
namespace {

/// Brightness of a pixel over the sum of its contributions: r_j Δθ / Δr, shared by the sub-rows.
double pixel_scale(const RowPart::Row& row, int sub_rows, int j) {
  const Acquisition& a = row.acquisition;
  return a.range_m(j) * row.fan.step_rad / (a.range_spacing_m * sub_rows);
}

}  // namespace

void row_pixels(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                Integrator integrator, const RaySampling& sampling, std::span<float> pixels) {
  part.of_pixel.assign(pixels.size(), 0.0);
  integrate(part.segments(row), field, integrator, static_cast<int>(pixels.size()), part.of_pixel);
  for (std::size_t j = 0; j < pixels.size(); ++j)
    pixels[j] = static_cast<float>(part.of_pixel[j] *
                                   pixel_scale(row, sampling.sub_rows, static_cast<int>(j)));
}

void row_pixels_adjoint(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                        Integrator integrator, const RaySampling& sampling,
                        std::span<const float> pixel_gradients) {
  part.of_pixel.resize(pixel_gradients.size());
  for (std::size_t j = 0; j < pixel_gradients.size(); ++j)
    part.of_pixel[j] =
        double{pixel_gradients[j]} * pixel_scale(row, sampling.sub_rows, static_cast<int>(j));
  integrate_adjoint(part.segments(row), field, integrator, static_cast<int>(pixel_gradients.size()),
                    part.of_pixel, {part.d_extinction, {}, part.d_source});
}

}  // namespace sarnerf
