// SPDX-License-Identifier: Apache-2.0
// Learning from images that a radar with an impulse response has made.
#include <atomic>
#include <cmath>
#include <numbers>
#include <random>

#include "field/tensors.h"
#include "files/archives.h"
#include "ground_scene.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/nerf/trainer.h"
#include "small_grid.h"
#include "small_set.h"
#include "torch_catch.h"
#include "train/loss.h"
#include "train/response.h"

using namespace sarnerf;

namespace {

constexpr double kPixel_m = 0.2;

Acquisition acquisition(int n_azimuth, int n_range) {
  Acquisition a;
  a.slant_range_m = 4500.0;
  a.n_azimuth = n_azimuth;
  a.n_range = n_range;
  a.azimuth_spacing_m = a.range_spacing_m = kPixel_m;
  return a;
}

/// Three points and a bar in the dark.
PosedImage points(const Resolution& resolution, Image<float>* truth = nullptr) {
  PosedImage image{"points", acquisition(64, 80), Image<float>(64, 80)};
  image.power(30, 40) = 100.0f;
  image.power(33, 41) = 20.0f;
  image.power(12, 60) = 5.0f;
  for (int i = 40; i < 52; ++i) image.power(i, 20) = 10.0f;
  if (truth) *truth = image.power;
  convolve_power(image.power, impulse_response(resolution, kPixel_m, kPixel_m));
  return image;
}

Resolution resolution(double azimuth_m, double range_m, const char* window) {
  return {azimuth_m, range_m, window_from_text(window)};
}

double total(const Image<float>& image) {
  double all = 0.0;
  for (const float p : image.pixels()) all += double{p};
  return all;
}

double share_of_zeros(const Image<float>& image) {
  std::size_t n = 0;
  for (const float p : image.pixels()) n += p == 0.0f;
  return static_cast<double>(n) / static_cast<double>(image.pixels().size());
}

/// Images of the small grid through a response, and none of them near its borders.
std::vector<PosedImage> small_images(int n_views, double first_turn, const std::optional<Resolution>& through) {
  GridField truth = small_grid(31);
  truth.resolution = through;
  std::vector<PosedImage> images;
  for (int n = 0; n < n_views; ++n) {
    const Acquisition a = small_acquisition(2.0 * std::numbers::pi * (n + first_turn) / n_views);
    images.push_back({"view_" + std::to_string(n), a, render_view(truth, a)});
  }
  return images;
}

const Box kSmallBox{glm::dvec3(-3.0, -2.0, -3.0), glm::dvec3(3.0, 2.0, 3.0)};

}  // namespace

TEST_CASE("a response as matrices does what it does as a convolution") {
  const Resolution r = resolution(0.5, 0.3, "taylor:-35");
  Image<float> truth;
  const PosedImage image = points(r, &truth);
  const auto matrices = response_matrices({image, image}, r);
  CHECK(matrices[0] == matrices[1]);
  const Border& border = matrices[0]->border;
  torch::Tensor wide = torch::zeros({64 + 2 * border.azimuth, 80 + 2 * border.range});
  wide.narrow(0, border.azimuth, 64).narrow(1, border.range, 80).copy_(tensor_of(truth));
  const torch::Tensor pixels = matrices[0]->of(wide), any = torch::rand_like(pixels);
  CHECK((pixels * any).sum().item<double>() == Approx((wide * matrices[0]->adjoint_of(any)).sum().item<double>()).epsilon(1e-4));
  const Image<float> seen = image_of(pixels);
  for (std::size_t n = 0; n < seen.pixels().size(); ++n)
    REQUIRE(seen.pixels()[n] == Approx(image.power.pixels()[n]).epsilon(1e-4).margin(1e-9));
}

TEST_CASE("a deconvolved image is dark between points and becomes the image again through the response") {
  for (const Resolution& r : {resolution(0.6, 0.6, "taylor:-35"), resolution(0.305, 0.305, "none"), resolution(0.9, 0.3, "hamming")}) {
    INFO(text_of(r.window));
    const PosedImage image = points(r);
    const Image<float> sharp = richardson_lucy({image}, r).front().power;
    CHECK(share_of_zeros(image.power) == 0.0);
    CHECK(share_of_zeros(sharp) > 0.95);
    CHECK(total(sharp) == Approx(245.0).epsilon(0.01));
    Image<float> seen = sharp;
    convolve_power(seen, impulse_response(r, kPixel_m, kPixel_m));
    CHECK(psnr_db(seen, image.power, 100.0) > 65.0);
  }
}

TEST_CASE("sharpening an even ground leaves it even up to the borders") {
  const Resolution r = resolution(0.6, 0.6, "taylor:-35");
  const Border border = border_of(impulse_response(r, kPixel_m, kPixel_m), 64, 64);
  // As sar_render makes it: what leaks in from beyond the borders is there.
  const Acquisition wide = widened(acquisition(48, 48), border);
  Image<float> ground(wide.n_azimuth, wide.n_range, 2.0f);
  convolve_power(ground, impulse_response(r, kPixel_m, kPixel_m));
  const PosedImage image{"ground", acquisition(48, 48), without_border(ground, border)};
  const Image<float> sharp = richardson_lucy({image}, r).front().power;
  for (const float p : sharp.pixels()) REQUIRE(p == Approx(2.0).epsilon(0.25));
  CHECK(sharp(24, 24) == Approx(2.0).epsilon(0.01));
}

TEST_CASE("what is black stays black and too coarse a spacing is refused") {
  const Resolution r = resolution(0.6, 0.6, "taylor:-35");
  const PosedImage black{"black", acquisition(8, 8), Image<float>(8, 8)};
  CHECK(share_of_zeros(richardson_lucy({black}, r).front().power) == 1.0);
  CHECK_THROWS_AS(richardson_lucy({black}, resolution(0.1, 0.1, "taylor:-35")), UsageError);
}

TEST_CASE("a view of a field with a response is its view without one seen through it") {
  GridField field = small_grid(31);
  const Acquisition a = small_acquisition(0.7);
  const Resolution r = resolution(0.9, 0.9, "taylor:-35");
  const ImpulseResponse response = impulse_response(r, a.azimuth_spacing_m, a.range_spacing_m);
  const Border border = border_of(response, a.n_azimuth, a.n_range);
  Image<float> expected = render_view(field, widened(a, border));
  convolve_power(expected, response);
  expected = without_border(expected, border);
  const Image<float> sharp = render_view(field, a);
  field.resolution = r;
  const Image<float> seen = render_view(field, a);
  REQUIRE(seen.pixels().size() == sharp.pixels().size());
  double change = 0.0;
  for (std::size_t n = 0; n < seen.pixels().size(); ++n) {
    CHECK(seen.pixels()[n] == expected.pixels()[n]);
    change = std::max(change, std::abs(double{seen.pixels()[n]} - double{sharp.pixels()[n]}));
  }
  CHECK(change > 0.01);
}

TEST_CASE("a field keeps its response in its archive and damaged ones are refused") {
  GridField field = small_grid(31);
  field.resolution = resolution(0.9, 0.4, "kaiser:3");
  const Archive archive = field.state();
  CHECK(restore_field(archive, "model.pt")->resolution == field.resolution);
  CHECK_FALSE(restore_field(small_grid(31).state(), "model.pt")->resolution);
  for (const auto& [piece, instead] : {std::pair("0.9", "-0.9"), std::pair("kaiser:3", "kaiser:x"), std::pair("[0.9,", "[")}) {
    Archive damaged = archive;
    const auto at = damaged.json.find(piece);
    REQUIRE(at != std::string::npos);
    damaged.json.replace(at, std::string(piece).size(), instead);
    CHECK_THROWS_AS(restore_field(damaged, "model.pt"), CheckpointError);
  }
}

TEST_CASE("a field learned from deconvolved images predicts images with the response better than one without") {
  const Resolution r = resolution(1.4, 1.4, "taylor:-35");
  const auto learned_psnr_db = [&](const std::optional<Resolution>& told) {
    TrainingSet set = training_set(small_images(24, 0.0, r), kSmallBox, {}, told);
    CHECK(set.resolution == told);
    CHECK(set.deconvolved.empty() == !told);
    Trainer trainer(set, small_options(set));
    for (int n = 0; n < 150; ++n) trainer.step(n / 150.0);
    CHECK(trainer.field().resolution == told);
    double mean = 0.0;
    for (const PosedImage& unseen : small_images(6, 0.5, r))
      mean += psnr_db(render_view(trainer.field(), unseen.acquisition), unseen.power, double{set.peak}) / 6.0;
    return mean;
  };
  const double with = learned_psnr_db(r), without = learned_psnr_db(std::nullopt);
  INFO(with << " dB with the response and " << without << " dB without it");
  CHECK(with > without + 3.0);
}

TEST_CASE("speckle over a ground is not deconvolved") {
  const TrainingSet set = training_set(speckled_scene(36, 1.0), ground_scene_box(), {}, kGroundResolution);
  REQUIRE(set.ground);
  CHECK(set.ground->speckled);
  CHECK(set.resolution == kGroundResolution);
  CHECK(set.deconvolved.empty());
}

TEST_CASE("speckled views too few to tell a ground are learned without the response") {
  const TrainingSet set = training_set(speckled_scene(4, 1.0), ground_scene_box(), {}, kGroundResolution);
  CHECK_FALSE(set.ground);
  CHECK_FALSE(set.resolution);
  CHECK(set.deconvolved.empty());
}

TEST_CASE("a row's gradient is that of its view's likelihood through the response") {
  const TrainingSet set = training_set(speckled_scene(12, 1.0), ground_scene_box(), {}, kGroundResolution);
  const Acquisition& a = set.images[2].acquisition;
  const double epsilon = 0.7;
  const PixelLoss pixel{1.0, epsilon};
  DataTerm term(set, pixel);
  const ImpulseResponse response = impulse_response(*set.resolution, a.azimuth_spacing_m, a.range_spacing_m);

  // A view of random rows, all but the first of them put by an earlier step; the first one's last pixels are not rendered.
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(0.5f, 3.0f);
  Image<float> view(a.n_azimuth, a.n_range);
  for (float& p : view.pixels()) p = value(random);
  RowBatch all;
  for (int i = 0; i < a.n_azimuth; ++i) all.rows.push_back({2, static_cast<std::uint32_t>(i)});
  all.counts.assign(view.pixels().size(), 1);
  term.of(all, tensor_of(view).flatten());
  const int row = a.n_azimuth / 2, n_counting = a.n_range - 5;
  Image<float> changed = view;
  for (int j = 0; j < n_counting; ++j) changed(row, j) = value(random);
  torch::Tensor pixels = tensor_of(changed)[row].clone();
  pixels.narrow(0, n_counting, 5).zero_();
  RowBatch batch;
  batch.rows.push_back({2, static_cast<std::uint32_t>(row)});
  batch.counts.assign(static_cast<std::size_t>(n_counting), 1);
  batch.counts.resize(static_cast<std::size_t>(a.n_range), 0);
  const DataLoss loss = term.of(batch, pixels);
  CHECK(loss.n_pixels == view.pixels().size());

  // The mean seen, in double, beyond the borders the ground's mean; the error; and back along both axes.
  const auto tap2 = [](const Kernel& kernel, int n) {
    if (std::abs(n) > kernel.reach()) return 0.0;
    const double tap = kernel.taps[static_cast<std::size_t>(kernel.reach() + n)];
    return tap * tap;
  };
  double level = 0.0;
  for (int i = 0; i < a.n_azimuth; ++i)
    for (const float p : ground_bins(*set.ground->plane, a, i).power) level += double{p} / (a.n_azimuth * a.n_range);
  for (const int j : {3, a.n_range / 2, n_counting - 1}) {
    double gradient = 0.0;
    for (int m = 0; m < a.n_azimuth; ++m)
      for (int n = 0; n < a.n_range; ++n) {
        const double share = tap2(response.azimuth, row - m) * tap2(response.range, j - n);
        if (share < 1e-7) continue;
        double mean = level;
        for (int k = 0; k < a.n_azimuth; ++k)
          for (int l = 0; l < a.n_range; ++l)
            mean += tap2(response.azimuth, m - k) * tap2(response.range, n - l) * (double{changed(k, l)} - level);
        const double deviation = std::hypot(std::max(0.0, mean), epsilon), error = (mean - double{set.images[2].power(m, n)}) / deviation;
        gradient += 2.0 * share * error / deviation;
      }
    CHECK(loss.gradient[j].item<double>() == Approx(gradient).epsilon(2e-3).margin(2e-4));
  }
  CHECK(loss.gradient.narrow(0, n_counting, 5).abs().max().item<float>() == 0.0f);

  Archive archive;
  term.save(archive);
  DataTerm again(set, pixel);
  again.restore(archive, "latest.pt");
  CHECK(torch::equal(again.of(batch, pixels).gradient, term.of(batch, pixels).gradient));
  archive.tensors["rendered_rows"] = archive.tensors["rendered_rows"].narrow(0, 0, 7);
  CHECK_THROWS_AS(again.restore(archive, "latest.pt"), CheckpointError);
}

TEST_CASE("training through a response goes on bit by bit from a checkpoint") {
  const TrainingSet set = training_set(speckled_scene(12, 1.0), ground_scene_box(), {.ground_m = 0.0, .above_ground_m = {}}, kGroundResolution);
  TrainerOptions options = default_options(set, "grid");
  options.grid.voxel_size_m = 1.0;
  options.rows_per_step = 12;
  Trainer straight(set, options), broken(set, options), resumed(set, options);
  for (int n = 0; n < 12; ++n) {
    straight.step(n / 12.0);
    if (n < 6) broken.step(n / 12.0);
  }
  resumed.restore(broken.checkpoint(), "latest.pt");
  for (int n = 6; n < 12; ++n) resumed.step(n / 12.0);
  CHECK(same_bits(straight.checkpoint(), resumed.checkpoint()));
  CHECK(straight.field().resolution == set.resolution);
}
