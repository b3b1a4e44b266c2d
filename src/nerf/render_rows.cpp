// SPDX-License-Identifier: Apache-2.0
#include <torch/csrc/autograd/custom_function.h>

#include <optional>

#include "row_rays.h"
#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {
namespace {

/// What the backward pass needs of the forward one. Its memory comes from the field's last pass and goes back to it.
struct Pass : torch::CustomClassHolder {
  Pass(const GridField& grid, const RaySampling& sampling) : field(&grid), idle(grid.idle_memory()) {
    if (!idle->empty()) {
      memory = std::move(idle->back());
      idle->pop_back();
    }
    grid.values(memory.values);
    renderer.emplace(grid.view(memory.values), grid.channels(), grid.occupancy(), sampling, memory.rows, grid.ground.get());
    memory.rows = renderer->memory();
  }
  ~Pass() override { idle->push_back(std::move(memory)); }
  Pass(const Pass&) = delete;
  Pass& operator=(const Pass&) = delete;

  const GridField* field;
  std::shared_ptr<std::vector<GridField::Memory>> idle;
  GridField::Memory memory;
  std::optional<RowRenderer> renderer;
};

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
    torch::Tensor pixels = torch::empty({static_cast<std::int64_t>(n_pixels(rows))}, torch::kFloat);
    pass->renderer->forward(rows, numbers(pixels));
    return pixels;
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass = c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const auto saved = context->get_saved_variables();
    const torch::Tensor d_pixels = gradients[0].contiguous();
    const GridField& field = *pass->field;
    std::vector<float>& d_active = pass->memory.d_active;
    d_active.resize(field.n_active() * static_cast<std::size_t>(field.channels().count()));
    pass->renderer->backward(numbers(d_pixels), field.active_voxels(), d_active);

    torch::Tensor d_depth = torch::empty_like(saved[0]), d_coefficients = torch::empty_like(saved[1]);
    field.parameter_gradients(d_active, d_depth.data_ptr<float>(), d_coefficients.data_ptr<float>());
    return {d_depth, d_coefficients, {}, {}};
  }
};

}  // namespace

torch::Tensor GridField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const {
  const auto pass = c10::make_intrusive<Pass>(*this, sampling);
  return RenderRows::apply(log_depth, coefficients, pass, rows);
}

void GridField::render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                            std::span<float> pixels) const {
  Pass(*this, sampling).renderer->forward(rows, pixels);
}

}  // namespace sarnerf
