// SPDX-License-Identifier: Apache-2.0
// VoxelAdam against LibTorch's Adam, and what it leaves alone.
#include "train/grid_learner.h"

#include <torch/optim/adam.h>

#include "small_grid.h"
#include "torch_catch.h"

using namespace sarnerf;

TEST_CASE("voxels that are met move as LibTorch's Adam moves them; the others stay") {
  GridField field = small_grid(7);
  torch::Tensor density = field.log_depth.detach().clone().set_requires_grad(true);
  torch::Tensor source = field.coefficients.detach().clone().set_requires_grad(true);
  const auto group = [](const torch::Tensor& parameter, double rate) {
    return torch::optim::OptimizerParamGroup(
        {parameter}, std::make_unique<torch::optim::AdamOptions>(
                         torch::optim::AdamOptions(rate).betas({0.9, 0.99}).eps(1e-15)));
  };
  torch::optim::Adam reference({group(density, 0.3), group(source, 0.05)});
  VoxelAdam adam(field);
  std::vector<std::uint8_t> moves(field.n_active(), 1);
  torch::manual_seed(4);
  for (int step = 0; step < 6; ++step) {
    const torch::Tensor dd = torch::randn_like(density.detach()), ds = 1e-6 * torch::randn_like(source.detach());
    field.log_depth.mutable_grad() = dd.clone();
    field.coefficients.mutable_grad() = ds.clone();
    density.mutable_grad() = dd.clone();
    source.mutable_grad() = ds.clone();
    adam.step(field, moves, {0.3, 0.05});
    reference.step();
  }
  CHECK((field.log_depth - density).abs().max().item<float>() < 1e-5f);
  CHECK((field.coefficients - source).abs().max().item<float>() < 1e-5f);

  const torch::Tensor before = field.log_depth.detach().clone(), source_before = field.coefficients.detach().clone();
  std::fill(moves.begin(), moves.end(), std::uint8_t{0});
  moves[3] = 1;
  adam.step(field, moves, {0.3, 0.05});
  const torch::Tensor moved = (field.log_depth - before).abs();
  CHECK(moved[3].item<float>() > 0.0f);
  CHECK((moved > 0.0f).sum().item<std::int64_t>() == 1);
  CHECK(((field.coefficients - source_before).abs().sum(1) > 0.0f).sum().item<std::int64_t>() == 1);
  CHECK(adam.steps() == 7);
}
