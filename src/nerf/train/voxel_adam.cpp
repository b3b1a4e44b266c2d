// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "train/grid_learner.h"

namespace sarnerf {

namespace {

constexpr float kBeta1 = 0.9f, kBeta2 = 0.99f, kEpsilon = 1e-15f;
constexpr std::size_t kGrain = 1 << 12;  ///< voxels that a thread takes at a time

/// Parameters of one kind and what belongs to them, `n` for each voxel.
struct Parameters {
  float* value;
  const float* gradient;
  float* mean;
  float* square;
  std::size_t n;
  float rate;  ///< over the mean's bias correction
  float decay;

  void move(std::size_t voxel, float share, float square_correction) const {
    for (std::size_t k = voxel * n; k < (voxel + 1) * n; ++k) {
      mean[k] = kBeta1 * mean[k] + (1.0f - kBeta1) * gradient[k];
      square[k] = kBeta2 * square[k] + (1.0f - kBeta2) * gradient[k] * gradient[k];
      value[k] -= share * (decay * value[k] + rate * mean[k] / (std::sqrt(square[k] * square_correction) + kEpsilon));
    }
  }
};

}  // namespace

VoxelAdam::VoxelAdam(const GridField& field)
    : mean_density_(torch::zeros_like(field.log_depth.detach())),
      square_density_(torch::zeros_like(mean_density_)),
      mean_source_(torch::zeros_like(field.coefficients.detach())),
      square_source_(torch::zeros_like(mean_source_)) {}

void VoxelAdam::step(GridField& field, std::span<const float> share, const Rates& rates) {
  ++steps_;
  const auto t = static_cast<double>(steps_);
  const double mean_correction = 1.0 / (1.0 - std::pow(double{kBeta1}, t));
  const auto square_correction = static_cast<float>(1.0 / (1.0 - std::pow(double{kBeta2}, t)));
  const auto of = [&](torch::Tensor& value, torch::Tensor& mean, torch::Tensor& square, double rate, double decay) {
    return Parameters{value.data_ptr<float>(), value.grad().data_ptr<float>(), mean.data_ptr<float>(),
                      square.data_ptr<float>(),
                      value.dim() == 1 ? std::size_t{1} : static_cast<std::size_t>(value.size(1)),
                      static_cast<float>(rate * mean_correction),
                      static_cast<float>(decay)};
  };
  const Parameters density = of(field.log_depth, mean_density_, square_density_, rates.density, 0.0);
  const Parameters source = of(field.coefficients, mean_source_, square_source_, rates.source, rates.source_decay);
  parallel_for(share.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      if (share[n] == 0.0f) continue;
      density.move(n, share[n], square_correction);
      source.move(n, share[n], square_correction);
    }
  });
}

void VoxelAdam::keep(const torch::Tensor& places) {
  for (torch::Tensor* t : {&mean_density_, &square_density_, &mean_source_, &square_source_})
    *t = t->index_select(0, places);
}

void VoxelAdam::save(Archive& archive) const {
  archive.tensors["adam_mean_density"] = mean_density_.clone();
  archive.tensors["adam_square_density"] = square_density_.clone();
  archive.tensors["adam_mean_source"] = mean_source_.clone();
  archive.tensors["adam_square_source"] = square_source_.clone();
}

void VoxelAdam::restore(const Archive& archive, std::int64_t steps, const std::string& where) {
  steps_ = steps;
  const auto take = [&](const char* name, torch::Tensor& to) {
    const torch::Tensor t = archive.tensor(name, torch::kFloat, static_cast<int>(to.dim()), where).clone();
    if (t.sizes() != to.sizes())
      throw CheckpointError(where + ": the field and its optimiser do not belong together; the file is damaged");
    to = t;
  };
  take("adam_mean_density", mean_density_);
  take("adam_square_density", square_density_);
  take("adam_mean_source", mean_source_);
  take("adam_square_source", square_source_);
}

}  // namespace sarnerf
