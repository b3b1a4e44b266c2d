// SPDX-License-Identifier: Apache-2.0
#include "small_mlp.h"

#include <algorithm>

#include "sarnerf/nerf/row_renderer.h"
#include "small_grid.h"

namespace sarnerf {

TrainingSet small_set() {
  const GridField truth = small_grid(21);
  std::vector<PosedImage> images;
  for (const double azimuth_rad : {0.1, 1.7, 3.2, 4.9}) {
    const Acquisition a = small_acquisition(azimuth_rad);
    images.push_back({"view", a, render_view(truth, a)});
  }
  Box box_m;
  box_m.include({-2.0, -1.6, -2.0});
  box_m.include({2.0, 2.0, 2.0});
  return training_set(std::move(images), box_m);
}

TrainerOptions small_mlp_options(const TrainingSet& set) {
  TrainerOptions options = default_options(set, "mlp");
  options.mlp.shape = {3, 64, 1, 4, 2};
  options.mlp.refresh_steps = 3;
  options.rows_per_step = 6;
  return options;
}

MlpField small_mlp(std::uint64_t seed, Integrator integrator) {
  const TrainingSet set = small_set();
  MlpOptions options = small_mlp_options(set).mlp;
  options.shape.position_frequencies = 2;
  options.integrator = name(integrator);
  options.voxel_size_m = 0.25;
  MlpField field = initial_mlp_field(set, options, seed);
  const torch::NoGradGuard no_grad;
  for (const MlpLayer& layer : mlp_layers(options.shape)) {
    if (layer.name == "sigma") field.network().weight(layer).mul_(12.0);
    if (layer.name == "s") field.network().weight(layer).mul_(8.0);
  }
  field.refresh(0.0);
  return field;
}

torch::Tensor plain_rows(const MlpField& field, const torch::Tensor& parameters,
                         std::span<const RowRequest> rows, const RaySampling& sampling) {
  const RowSegments segments(rows, sampling, field.cache());
  const auto places = segments.places();
  const MlpNetwork network{field.network().shape, field.network().box_m, parameters};
  const MlpOutput out = mlp_forward(network, segments.point_m(), segments.ray_direction(),
                                    segments.ray_begin(), MlpKernel::plain);
  const MlpUnits& meaning = field.units();
  const torch::Tensor kappa = out.sigma_raw.clamp_min(0.0) / (2.0 * meaning.reference_bin_m);
  const torch::Tensor source = meaning.source_scale * (1.0 + out.s_raw.exp()).log();

  std::vector<torch::Tensor> images;
  for (const RowRequest& request : rows)
    images.push_back(torch::zeros({request.acquisition.n_range}, torch::kDouble));
  for (std::size_t q = 0; q + 1 < segments.ray_begin().size(); ++q) {
    const std::uint32_t begin = segments.ray_begin()[q];
    const std::int64_t n = segments.ray_begin()[q + 1] - begin;
    if (n == 0) continue;
    const std::size_t number = places[begin].row;
    const Acquisition& a = rows[number].acquisition;
    std::vector<double> length_m;
    torch::Tensor shares = torch::zeros({a.n_range, n}, torch::kDouble);
    for (std::int64_t s = 0; s < n; ++s) {
      const RowSegments::Place& place = places[begin + static_cast<std::size_t>(s)];
      length_m.push_back(place.length_m);
      const double far = place.near_bin + place.length_m / a.range_spacing_m;
      for (int j = 0; j < a.n_range; ++j) {
        const double overlap = std::min(far, j + 1.0) - std::max(place.near_bin, double(j));
        if (overlap > 0.0) shares[j][s] = overlap / (far - place.near_bin);
      }
    }
    const torch::Tensor x =
        2.0 * kappa.narrow(0, begin, n) * torch::tensor(length_m, torch::kDouble);
    const torch::Tensor gamma = source.narrow(0, begin, n);
    const bool gated = meaning.integrator == Integrator::paper_gated;
    const torch::Tensor triangle = torch::ones({n, n}, torch::kDouble).tril(gated ? 0 : -1);
    const torch::Tensor reaches = (-triangle.matmul(x)).exp();
    const torch::Tensor contribution = gamma * reaches * (gated ? x.tanh() : 1.0 - (-x).exp());
    std::vector<double> scale;
    for (int j = 0; j < a.n_range; ++j)
      scale.push_back(a.range_m(j) * (sampling.ray_spacing_m / a.slant_range_m) /
                      (a.range_spacing_m * sampling.sub_rows));
    images[number] =
        images[number] + shares.matmul(contribution) * torch::tensor(scale, torch::kDouble);
  }
  return torch::cat(images);
}

}  // namespace sarnerf
