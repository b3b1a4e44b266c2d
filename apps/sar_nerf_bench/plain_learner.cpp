// SPDX-License-Identifier: Apache-2.0
#include "plain_learner.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/nerf/trainer.h"
#include "torch_setup.h"

namespace sarnerf::bench {

namespace {

class TrainedField : public Contestant {
 public:
  TrainedField(TrainingSet set, const TrainerOptions& options) : trainer_(std::move(set), options) {}

  void step(double progress) override { trainer_.step(progress); }
  Image<float> render(const Acquisition& acquisition) const override {
    return render_view(trainer_.field(), acquisition);
  }

 private:
  Trainer trainer_;
};

}  // namespace

std::unique_ptr<Contestant> make_contestant(const std::string& field, TrainingSet set,
                                            std::uint64_t seed) {
  app::use_torch_threads(field == "grid" || field == "surface" ? 1 : thread_count());
  if (field == "plain") {
    PlainOptions options;
    options.seed = seed;
    return std::make_unique<PlainLearner>(std::move(set), options);
  }
  TrainerOptions options = default_options(set, field, Schedule::clock);
  options.seed = seed;
  return std::make_unique<TrainedField>(std::move(set), options);
}

namespace {

/// The box of all points at which any of the views is sampled: no point may leave the encoding's range, beyond which
/// its waves repeat.
Box sampled_box(const TrainingSet& set, const std::function<RayGrid(const Acquisition&)>& rays) {
  Box box;
  for (const PosedImage& image : set.images) {
    const Acquisition& a = image.acquisition;
    const RayGrid grid = rays(a);
    for (const int i : {0, a.n_azimuth - 1}) {
      for (const int j : {0, a.n_range - 1}) {
        for (const int k : {0, grid.fan().n_elevation - 1})
          box.include(grid.point_from_aim_m(a.row_offset_m(i), a.bin_offset_m(j), k));
      }
    }
  }
  return box;
}

}  // namespace

PlainLearner::PlainLearner(TrainingSet set, const PlainOptions& options)
    : set_(std::move(set)), options_(options), random_(options.seed) {
  network_ = make_mlp_network(
      options_.shape, sampled_box(set_, [this](const Acquisition& a) { return rays(a); }),
      options_.seed);
  for (const MlpLayer& layer : mlp_layers(options_.shape)) {
    if (layer.name == "sigma") network_.bias(layer).fill_(options_.initial_depth);
    if (layer.name == "s")
      network_.bias(layer).fill_(std::log(std::expm1(options_.initial_brightness)));
  }
  // A negligible epsilon: gradients of squares relative to the peak are small numbers.
  adam_ = std::make_unique<torch::optim::Adam>(
      std::vector<torch::Tensor>{network_.parameters},
      torch::optim::AdamOptions(options_.rate).eps(1e-15));
}

RayGrid PlainLearner::rays(const Acquisition& acquisition) const {
  return RayGrid(acquisition,
                 make_fan(angular_extent(acquisition, set_.box_m), acquisition.n_range));
}

torch::Tensor PlainLearner::render_row(const RayGrid& grid, int row, MlpKernel kernel) const {
  const Acquisition& a = grid.acquisition();
  const int n_rays = grid.fan().n_elevation;
  // The paper's lattice: a ray through the row's centre for each k, a sample at the centre of each of its bins.
  const double half_swath_m = 0.5 * a.n_range * a.range_spacing_m;
  std::vector<MarchRay> rays;
  for (int k = 0; k < n_rays; ++k)
    rays.push_back({slice_along_m(a, row, 0, 1), 0, k, {-half_swath_m, half_swath_m}, 0, k});
  AzimuthRows rows;
  rows.begin_row(grid, row, 1);
  rows.cut(grid, rays, a.range_spacing_m);
  std::vector<float> scale;
  for (int j = 0; j < a.n_range; ++j)
    scale.push_back(static_cast<float>(beta0_per_contribution(a, grid.fan().step_rad, 1, j)));

  const SampleBatch& batch = rows.batch();
  const MlpOutput out = mlp_forward(network_, batch.point_m, batch.ray_direction, batch.ray_begin, kernel);
  const torch::Tensor sigma = out.sigma_raw.view({n_rays, a.n_range}).relu();
  const torch::Tensor source =
      torch::softplus(out.s_raw.view({n_rays, a.n_range})) * source_scale();
  const torch::Tensor transmittance = (-sigma.cumsum(1)).exp();
  return (source * transmittance * sigma.tanh()).sum(0) * torch::tensor(scale);
}

void PlainLearner::step(double) {
  if (order_.empty()) {
    order_.resize(set_.images.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::shuffle(order_.begin(), order_.end(), random_);
  }
  const PosedImage& image = set_.images[order_.back()];
  order_.pop_back();
  const RayGrid grid = rays(image.acquisition);
  const double inverse =
      1.0 / (double{set_.peak} * double{set_.peak} * double(image.power.pixels().size()));
  adam_->zero_grad();
  last_loss_ = 0.0;
  for (int i = 0; i < image.power.n_azimuth(); ++i) {
    const std::span<const float> pixels = image.power.row(i);
    const torch::Tensor truth =
        torch::tensor(std::vector<float>(pixels.begin(), pixels.end()));  // [n_range]
    const torch::Tensor loss =
        (render_row(grid, i, MlpKernel::plain) - truth).square().sum() * inverse;
    loss.backward();
    last_loss_ += loss.item<double>();
  }
  ++n_steps_;
  if (!std::isfinite(last_loss_))
    throw NumericsError("plain: training diverges: the loss of step " + std::to_string(n_steps_) +
                        " is not finite");
  const double warm = std::min(1.0, double(n_steps_) / options_.warm_up_steps);
  static_cast<torch::optim::AdamOptions&>(adam_->param_groups()[0].options())
      .lr(warm * options_.rate);
  adam_->step();
}

Image<float> PlainLearner::render(const Acquisition& acquisition) const {
  const torch::NoGradGuard no_grad;
  const RayGrid grid = rays(acquisition);
  const MlpKernel kernel = best_mlp_kernel(options_.shape);
  Image<float> image(acquisition.n_azimuth, acquisition.n_range);
  for (int i = 0; i < image.n_azimuth(); ++i) {
    const torch::Tensor row = render_row(grid, i, kernel).contiguous();
    std::copy_n(row.data_ptr<float>(), image.n_range(), image.row(i).begin());
  }
  return image;
}

}  // namespace sarnerf::bench
