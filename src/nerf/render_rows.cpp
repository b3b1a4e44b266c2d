// SPDX-License-Identifier: Apache-2.0
#include <torch/csrc/autograd/custom_function.h>

#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {
namespace {

/// What the backward pass needs of the forward one.
struct Pass : torch::CustomClassHolder {
  const GridField* field = nullptr;
  std::vector<float> values;
  std::unique_ptr<RowRenderer> renderer;
};

std::int64_t n_pixels(std::span<const RowRequest> rows) {
  std::int64_t n = 0;
  for (const RowRequest& row : rows) n += row.acquisition.n_range;
  return n;
}

std::span<float> numbers(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), static_cast<std::size_t>(tensor.numel())};
}

/// RowRenderer as LibTorch sees it.
struct RenderRows : torch::autograd::Function<RenderRows> {
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& log_depth,
                               const torch::Tensor& coefficients, const c10::intrusive_ptr<Pass>& pass,
                               std::span<const RowRequest> rows) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    context->save_for_backward({log_depth, coefficients});
    torch::Tensor pixels = torch::empty({n_pixels(rows)}, torch::kFloat);
    pass->renderer->forward(rows, numbers(pixels));
    return pixels;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass = c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const auto saved = context->get_saved_variables();
    const torch::Tensor d_pixels = gradients[0].contiguous();
    std::vector<float> d_values(pass->values.size(), 0.0f);
    pass->renderer->backward(numbers(d_pixels), d_values);

    torch::Tensor d_depth = torch::empty_like(saved[0]), d_coefficients = torch::empty_like(saved[1]);
    pass->field->gather_gradients(pass->values, d_values, d_depth.data_ptr<float>(),
                                  d_coefficients.data_ptr<float>());
    return {d_depth, d_coefficients, {}, {}};
  }
};

}  // namespace

torch::Tensor GridField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const {
  auto pass = c10::make_intrusive<Pass>();
  pass->field = this;
  pass->values = values();
  pass->renderer = std::make_unique<RowRenderer>(view(pass->values), channels(), occupancy(), sampling);
  return RenderRows::apply(log_depth, coefficients, pass, rows);
}

void GridField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                            std::span<float> pixels) const {
  const std::vector<float> now = values();
  RowRenderer(view(now), channels(), occupancy(), sampling).forward(rows, pixels);
}

}  // namespace sarnerf
