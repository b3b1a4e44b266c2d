// SPDX-License-Identifier: Apache-2.0
// The field `paper`: its rows against the paper's formulas written out, what it leaves out, that it learns, and its file.
#include <algorithm>
#include <cmath>

#include "small_set.h"
#include "torch_catch.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/nerf/trainer.h"

using namespace sarnerf;

namespace {

Acquisition view_at(double azimuth_rad) {
  Acquisition a;
  a.azimuth_rad = azimuth_rad;
  a.slant_range_m = 5000.0;
  a.n_azimuth = 3;
  a.n_range = 16;
  a.azimuth_spacing_m = 0.5;
  a.range_spacing_m = 0.4;
  return a;
}

/// Views of 3 × 16 pixels, which hold the box, that are bright in the middle.
TrainingSet tiny_set() {
  std::vector<PosedImage> images;
  for (const double azimuth_rad : {0.3, 2.0, 4.1}) {
    const Acquisition a = view_at(azimuth_rad);
    Image<float> power(a.n_azimuth, a.n_range);
    for (int i = 0; i < a.n_azimuth; ++i)
      for (int j = 7; j < 9; ++j) power(i, j) = 0.5f + 0.1f * static_cast<float>(i + j);
    images.push_back({"view", a, power});
  }
  return training_set(std::move(images), {{-1.5, 0.0, -1.5}, {1.5, 1.2, 1.5}});
}

TrainerOptions small_options() {
  TrainerOptions options = default_options(tiny_set(), "paper", Schedule::steps);
  options.mlp.shape = {3, 32, 1, 3, 2};
  options.mlp.rate = 5e-3;
  options.mlp.warm_up_steps = 10;
  return options;
}

const MlpField& field_of(const Trainer& trainer) { return dynamic_cast<const MlpField&>(trainer.field()); }

}  // namespace

TEST_CASE("a row of the paper is the sum over an even fan of rays of scattering behind inclusive products") {
  Trainer trainer(tiny_set(), small_options());
  for (int n = 0; n < 5; ++n) trainer.step(0.1);
  const MlpField& field = field_of(trainer);
  CHECK(field.kind() == "paper");
  const Acquisition a = view_at(1.1);
  const Box box_m = field.occupied_box_m();
  const RayGrid grid(a, make_fan(angular_extent(a, box_m), a.n_range));
  const torch::NoGradGuard no_grad;
  MlpNetwork in_double = field.network();
  in_double.parameters = in_double.parameters.detach().to(torch::kDouble);
  for (int i = 0; i < a.n_azimuth; ++i) {
    // Whatever rays are asked for.
    RaySampling sampling;
    sampling.ray_spacing_m = 0.01;
    sampling.sub_rows = 5;
    sampling.deposit = Deposit::over_footprint;
    const std::vector<RowRequest> rows{{a, i, 0.9, 0.1}};
    const torch::Tensor row = field.render_rows(rows, sampling);
    REQUIRE(row.numel() == 16);
    std::vector<double> expected(16, 0.0);
    double largest = 0.0;
    for (int k = 0; k < grid.fan().n_elevation; ++k) {
      double transmittance = 1.0;
      const RangeInterval inside = clip_to_box(grid, a.row_offset_m(i), k, box_m);
      if (inside.empty()) continue;
      for (int j = 0; j < 16; ++j) {
        // The part of the bin that lies in the box.
        const double near_m = std::max(inside.near_m, a.bin_offset_m(j - 0.5)), far_m = std::min(inside.far_m, a.bin_offset_m(j + 0.5));
        if (!(far_m > near_m)) continue;
        const glm::vec3 point(grid.point_from_aim_m(a.row_offset_m(i), 0.5 * (near_m + far_m), k));
        const glm::vec3 direction(grid.direction(k));
        const std::vector<std::uint32_t> ray_begin{0, 1};
        const MlpOutput out = mlp_forward(in_double, {&point, 1}, {&direction, 1}, ray_begin, MlpKernel::plain);
        const double sigma = std::max(0.0, out.sigma_raw.item<double>()) * (far_m - near_m) / a.range_spacing_m;
        const double source = field.units().source_scale * out.s_raw.item<double>();
        transmittance *= std::exp(-sigma);
        const double r_m = a.slant_range_m + (j - 7.5) * a.range_spacing_m;
        expected[static_cast<std::size_t>(j)] += r_m * grid.fan().step_rad / a.range_spacing_m * source * transmittance * std::tanh(sigma);
      }
    }
    for (const double e : expected) largest = std::max(largest, std::abs(e));
    REQUIRE(largest > 0.0);
    // Kernels in bf16 are within a percent or two.
    for (int j = 0; j < 16; ++j) CHECK(row[j].item<double>() == Approx(expected[static_cast<std::size_t>(j)]).margin(0.03 * largest));
  }
}

TEST_CASE("the paper's encoding has sines and cosines alone, before and after learning") {
  Trainer trainer(tiny_set(), small_options());
  const auto is_clear = [&] {
    const torch::Tensor all = field_of(trainer).network().parameters.detach();
    torch::Tensor cleared = all.clone();
    clear_identity(field_of(trainer).network().shape, cleared);
    return torch::equal(all, cleared);
  };
  CHECK(is_clear());
  const torch::Tensor before = field_of(trainer).network().parameters.detach().clone();
  for (int n = 0; n < 5; ++n) trainer.step(0.1);
  CHECK_FALSE(torch::equal(field_of(trainer).network().parameters.detach(), before));
  CHECK(is_clear());
  // The point itself adds nothing: three columns of the first layer, of the one behind the skip, and of the direction's.
  torch::Tensor ones = torch::ones_like(before);
  clear_identity({3, 32, 1, 3, 2}, ones);
  CHECK((ones == 0).sum().item<int>() == 3 * 32 + 3 * 32 + 3 * 16);
}

TEST_CASE("the paper's method learns, and knows no ground") {
  TrainingSet set = tiny_set();
  Trainer trainer(set, small_options());
  double first = 0.0, last = 0.0;
  for (int n = 0; n < 150; ++n) {
    const double loss = trainer.step(n / 150.0).loss;
    if (n < 5) first += loss;
    if (n >= 145) last += loss;
  }
  CHECK(last < 0.3 * first);
  CHECK_FALSE(trainer.set().ground);
  CHECK(trainer.options().misfit == 0.0);
  CHECK(trainer.options().n_registrations == 0);
}

TEST_CASE("what the paper fixes is no option") {
  const TrainerOptions options = default_options(tiny_set(), "paper", Schedule::steps);
  const TrainerOptions again = options_from_json(options_json(options));
  CHECK(again.mlp.literal);
  CHECK(again.mlp.integrator == "paper-gated");
  CHECK(again.misfit == 0.0);
  for (const char* name : {"integrator", "end_depth", "misfit", "n_registrations", "prune_depth", "renderings"})
    CHECK_THROWS_AS(options_from_json("{\"field\": \"paper\", \"" + std::string(name) + "\": 1}"), UsageError);
}

TEST_CASE("the field of the paper is restored bit by bit") {
  Trainer trainer(tiny_set(), small_options());
  trainer.step(0.1);
  const Archive archive = trainer.field().state();
  const auto restored = restore_field(archive, "here");
  CHECK(restored->kind() == "paper");
  CHECK(same_bits(restored->state(), archive));
  const auto image = [](const LearnedField& f) { return render_view(f, view_at(0.5)); };
  CHECK(std::ranges::equal(image(*restored).pixels(), image(trainer.field()).pixels()));
}
