// SPDX-License-Identifier: Apache-2.0
#include <torch/csrc/autograd/custom_function.h>

#include <algorithm>
#include <string>

#include "row_rays.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/row_segments.h"

namespace sarnerf {
namespace {

/// Rows that are rendered at a time where no gradient is wanted: bounds the memory.
constexpr std::size_t kRowsAtATime = 8;

/// What the backward pass needs of the forward one.
struct Pass : torch::CustomClassHolder {
  Pass(std::span<const RowRequest> rows, const RaySampling& sampling, const MlpField& field)
      : segments(rows, sampling, field.cache(), field.ground), integrator(field.meaning().integrator) {}

  RowSegments segments;
  Integrator integrator;
};

std::span<float> numbers(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), static_cast<std::size_t>(tensor.numel())};
}

/// RowSegments as LibTorch sees it.
struct IntegrateRows : torch::autograd::Function<IntegrateRows> {
  static torch::Tensor forward(torch::autograd::AutogradContext* context,
                               const torch::Tensor& extinction_per_m,
                               const torch::Tensor& brightness,
                               const c10::intrusive_ptr<Pass>& pass) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    torch::Tensor pixels =
        torch::empty({static_cast<std::int64_t>(pass->segments.n_pixels())}, torch::kFloat);
    pass->segments.integrate(numbers(extinction_per_m.contiguous()),
                             numbers(brightness.contiguous()), pass->integrator, numbers(pixels));
    return pixels;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass =
        c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const auto n = static_cast<std::int64_t>(pass->segments.n_segments());
    torch::Tensor d_extinction = torch::empty({n}, torch::kFloat),
                  d_brightness = torch::empty_like(d_extinction);
    pass->segments.adjoint(numbers(gradients[0].contiguous()), pass->integrator,
                           numbers(d_extinction), numbers(d_brightness));
    return {d_extinction, d_brightness, {}};
  }
};

}  // namespace

torch::Tensor MlpField::render_rows(std::span<const RowRequest> rows,
                                    const RaySampling& sampling) const {
  const auto pass = c10::make_intrusive<Pass>(rows, sampling, *this);
  const RowSegments& s = pass->segments;
  const Values values = evaluate(s.point_m(), s.ray_direction(), s.ray_begin());
  return IntegrateRows::apply(values.extinction_per_m.to(torch::kFloat),
                              values.brightness.to(torch::kFloat), pass);
}

void MlpField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                           std::span<float> pixels) const {
  if (pixels.size() != n_pixels(rows))
    throw UsageError("the rows have " + std::to_string(n_pixels(rows)) + " pixels, not " +
                     std::to_string(pixels.size()));
  const torch::NoGradGuard no_grad;
  for (std::size_t first = 0; first < rows.size(); first += kRowsAtATime) {
    const auto some = rows.subspan(first, std::min(kRowsAtATime, rows.size() - first));
    const torch::Tensor image = render_rows(some, sampling);
    std::copy_n(image.data_ptr<float>(), image.numel(), pixels.begin());
    pixels = pixels.subspan(static_cast<std::size_t>(image.numel()));
  }
}

}  // namespace sarnerf
