// SPDX-License-Identifier: Apache-2.0
// Every term of the loss: its value against its definition in double, its gradient against central differences of its value.
#include "train/loss.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "field/rows.h"
#include "ground_scene.h"
#include "sarnerf/core/error.h"
#include "small_grid.h"
#include "small_mlp.h"
#include "small_set.h"
#include "torch_catch.h"
#include "train/grid_learner.h"

using namespace sarnerf;

namespace {

/// Speckled views of the block on its ground.
TrainingSet speckled_ground(const std::optional<Resolution>& resolution = {}) {
  return training_set(speckled_scene(12, 1.0), ground_scene_box(), {}, resolution);
}

RowBatch batch_of(const TrainingSet& set, std::span<const RowReference> rows) {
  RowBatch batch;
  for (const RowReference& r : rows) {
    batch.rows.push_back(r);
    const auto pixels = set.images[r.view].power.row(static_cast<int>(r.row));
    batch.image.insert(batch.image.end(), pixels.begin(), pixels.end());
    batch.counts.insert(batch.counts.end(), pixels.size(), 1);
  }
  return batch;
}

torch::Tensor random_pixels(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0.02f, 0.5f);
  torch::Tensor pixels = torch::empty({static_cast<std::int64_t>(n)}, torch::kFloat);
  for (std::size_t k = 0; k < n; ++k) pixels.data_ptr<float>()[k] = value(random);
  return pixels;
}

}  // namespace

TEST_CASE("a pixel's loss is the product of two errors, and its gradient holds the denominator constant") {
  const auto check = [](const PixelLoss& loss, double first, double second, double image) {
    const double mu = std::max(0.0, 0.5 * (first + second));
    const double d = std::sqrt(loss.relative * loss.relative * mu * mu + loss.absolute * loss.absolute);
    const PixelLoss::Term term = loss.of(first, second, image);
    CHECK(term.value == Approx((first - image) / d * (second - image) / d).epsilon(1e-12));
    // A squared loss of the same denominator is one whose denominator does not move.
    const PixelLoss held{0.0, d};
    const double step = 1e-6 * d;
    const auto difference = [&](double by_first, double by_second) {
      return (held.of(first + by_first, second + by_second, image).value - held.of(first - by_first, second - by_second, image).value) /
             (2.0 * step);
    };
    CHECK(term.by_first == Approx(difference(step, 0.0)).epsilon(1e-6).margin(1e-9 / d));
    CHECK(term.by_second == Approx(difference(0.0, step)).epsilon(1e-6).margin(1e-9 / d));
  };
  for (const double scale : {1e-20, 0.7, 1e20}) {
    for (const double rendered : {-0.4, 0.0, 0.3, 5.0})
      for (const double image : {0.0, 0.3, 2.0, 40.0}) {
        for (const double other : {rendered, 0.9 * rendered + 0.2}) {
          check({0.0, scale}, rendered * scale, other * scale, image * scale);
          check({0.7, scale}, rendered * scale, other * scale, image * scale);
        }
      }
  }
}

TEST_CASE("which loss it is follows from the images") {
  const TrainingSet dark = small_set(4), ground = speckled_ground();
  REQUIRE(ground.ground);
  TrainerOptions options = default_options(ground, "grid");
  const PixelLoss relative = pixel_loss(ground, options);
  REQUIRE(ground.ground->looks);
  CHECK(relative.relative == Approx(std::sqrt(1.0 / *ground.ground->looks + options.misfit * options.misfit)));
  CHECK(relative.absolute == Approx(options.misfit * ground.ground->plane->mean_power()));
  TrainingSet clean = ground;
  clean.ground->speckled = false;
  CHECK(pixel_loss(clean, options).relative == Approx(options.misfit));
  options.misfit = 0.0;
  CHECK(pixel_loss(ground, options).relative == 0.0);
  CHECK(pixel_loss(dark, default_options(dark, "grid")).absolute == Approx(double{dark.peak}));

  // And it is said.
  CHECK(loss_text(dark, default_options(dark, "grid")) == "mean square error of power over the peak's square (paper, eq. 31)");
  options = default_options(ground, "grid");
  CHECK(loss_text(ground, options).find("mean of (error of power / s)^2 with s^2 = (0.85") == 0);
  CHECK(loss_text(ground, default_options(ground, "surface")).find("(linear beyond 1 s)") != std::string::npos);
  CHECK(loss_text(speckled_ground(kGroundResolution), options).find("mean of (error of power / s)^2") == 0);
  CHECK(loss_text(speckled_ground(kGroundResolution), options).find("seen through the impulse response") != std::string::npos);
}

TEST_CASE("beyond its bound an error counts linearly, and the gradient is that of the value") {
  PixelLoss loss{0.0, 2.0};
  loss.bound = 3.0;
  const PixelLoss squares{0.0, 2.0};
  for (const double first : {0.0, 5.0, 11.0, 90.0})
    for (const double second : {0.0, 1.0, 30.0})
      for (const double image : {0.0, 9.0, 40.0}) {
        const PixelLoss::Term term = loss.of(first, second, image);
        constexpr double kStep = 1e-5;
        CHECK(term.by_first == Approx((loss.of(first + kStep, second, image).value - loss.of(first - kStep, second, image).value) / (2.0 * kStep)).margin(1e-9));
        CHECK(term.by_second == Approx((loss.of(first, second + kStep, image).value - loss.of(first, second - kStep, image).value) / (2.0 * kStep)).margin(1e-9));
        CHECK(std::abs(term.by_first) <= 1.5);
        if (std::abs(first - image) < 6.0 && std::abs(second - image) < 6.0) CHECK(term.value == squares.of(first, second, image).value);
      }
  // Huber's function where both renderings are one.
  CHECK(loss.of(1.0, 1.0, 21.0).value == Approx(2.0 * 3.0 * 10.0 - 9.0));
}

TEST_CASE("errors of roots have the gradient of their product") {
  const PixelLoss loss{0.0, 3.0, 0.01};
  for (const double first : {0.0, 0.2, 5.0})
    for (const double second : {0.1, 4.0})
      for (const double image : {0.0, 0.7, 9.0}) {
        const auto e = [&](double mu) { return (std::sqrt(mu + 0.03) - std::sqrt(image + 0.03)) / std::sqrt(3.0); };
        const PixelLoss::Term term = loss.of(first, second, image);
        CHECK(term.value == Approx(e(first) * e(second)).epsilon(1e-12).margin(1e-15));
        constexpr double kStep = 1e-6;
        const double by_first = (e(first + kStep) - e(first)) / kStep * e(second), by_second = (e(second + kStep) - e(second)) / kStep * e(first);
        CHECK(term.by_first == Approx(by_first).epsilon(1e-4).margin(1e-9));
        CHECK(term.by_second == Approx(by_second).epsilon(1e-4).margin(1e-9));
      }
}

TEST_CASE("pixels whose rays were not rendered count neither in the value nor in the gradient") {
  const TrainingSet set = small_set(4);
  const std::array<RowReference, 2> rows{{{0, 3}, {2, 4}}};
  RowBatch batch = batch_of(set, rows);
  const torch::Tensor rendered = random_pixels(batch.image.size(), 3);
  batch.counts[5] = batch.counts[20] = 0;
  DataTerm term(set, {0.0, 0.25});
  const DataLoss loss = term.of(batch, rendered);
  double value = 0.0, square_error = 0.0, image_square = 0.0;
  for (std::size_t n = 0; n < batch.image.size(); ++n) {
    const double error = double{rendered.data_ptr<float>()[n]} - double{batch.image[n]};
    const double counts = batch.counts[n];
    value += counts * 16.0 * error * error;
    square_error += counts * error * error;
    image_square += counts * double{batch.image[n]} * double{batch.image[n]};
    CHECK(loss.gradient[static_cast<std::int64_t>(n)].item<double>() == Approx(counts * 32.0 * error).epsilon(1e-5));
  }
  CHECK(loss.n_pixels == batch.image.size() - 2);
  CHECK(loss.value == Approx(value).epsilon(1e-10));
  CHECK(loss.per_pixel(loss.value) == Approx(value / static_cast<double>(loss.n_pixels)).epsilon(1e-10));
  CHECK(loss.square_error == Approx(square_error).epsilon(1e-10));
  CHECK(loss.image_square == Approx(image_square).epsilon(1e-10));
}

TEST_CASE("the gradient through a response agrees with central differences of the value of whole views") {
  const TrainingSet set = speckled_ground(kGroundResolution);
  REQUIRE(set.ground);
  const std::array<RowReference, 3> rows{{{2, 20}, {2, 22}, {7, 11}}};
  const RowBatch batch = batch_of(set, rows);
  // What dwarfs all that is rendered holds the denominator: the value then is the function whose gradient is given.
  const PixelLoss pixel{1.0, 1e5};
  const torch::Tensor at = random_pixels(batch.image.size(), 9);
  DataTerm term(set, pixel);
  const DataLoss loss = term.of(batch, at);
  CHECK(loss.n_pixels == 2 * set.images[2].power.pixels().size());
  const auto moved = [&](std::int64_t pixel_number, double step) {
    torch::Tensor pixels = at.clone();
    pixels[pixel_number] += step;
    return DataTerm(set, pixel).of(batch, pixels).value;
  };
  const auto n_range = static_cast<std::int64_t>(set.images[2].power.n_range());
  for (const std::int64_t n : {std::int64_t{3}, n_range / 2, n_range + n_range / 2, 2 * n_range + 40}) {
    constexpr double kStep = 0.5;
    CHECK((moved(n, kStep) - moved(n, -kStep)) / (2.0 * kStep) == Approx(loss.gradient[n].item<double>()).epsilon(2e-3));
  }
}

TEST_CASE("two renderings of the same pixels give what one gives, and their independent noise cancels in the mean") {
  for (const bool through_response : {false, true}) {
    const TrainingSet set = through_response ? speckled_ground(kGroundResolution) : small_set(4);
    const std::array<RowReference, 2> rows{{{2, 3}, {2, 4}}};
    const RowBatch batch = batch_of(set, rows);
    const PixelLoss pixel{0.0, 0.25};
    const torch::Tensor at = random_pixels(batch.image.size(), 9);
    const auto n = static_cast<std::int64_t>(batch.image.size());
    const DataLoss one = DataTerm(set, pixel).of(batch, at), two = DataTerm(set, pixel, 2).of(batch, at.repeat({2}));
    CHECK(two.n_pixels == one.n_pixels);
    CHECK(two.value == Approx(one.value).epsilon(1e-6));
    CHECK(torch::allclose(two.gradient.narrow(0, 0, n) + two.gradient.narrow(0, n, n), one.gradient, 1e-4, 1e-6));

    // Noise of standard deviation 0.1 in every pixel raises the mean of a square by its variance, but not that of a product.
    double single = 0.0, product = 0.0;
    constexpr int kDraws = 400;
    for (int draw = 0; draw < kDraws; ++draw) {
      torch::manual_seed(draw);
      const torch::Tensor noisy = torch::cat({at + 0.1 * torch::randn({n}), at + 0.1 * torch::randn({n})});
      single += DataTerm(set, pixel).of(batch, noisy.narrow(0, 0, n)).value / kDraws;
      product += DataTerm(set, pixel, 2).of(batch, noisy).value / kDraws;
    }
    CHECK(single - one.value > 5.0 * std::abs(product - one.value));
  }
}

TEST_CASE("rows come in blocks where a response mixes neighbours") {
  CHECK(DataTerm(small_set(4), {0.0, 0.25}).rows_of_a_block() == 1);
  CHECK(DataTerm(speckled_ground(), {1.0, 1.0}).rows_of_a_block() == 1);
  CHECK(DataTerm(speckled_ground(kGroundResolution), {1.0, 1.0}).rows_of_a_block() >= 8);
}

TEST_CASE("rows beside rows that were not rendered do not count") {
  const TrainingSet set = speckled_ground(kGroundResolution);
  const PixelLoss pixel{1.0, 1e5};
  const int n_azimuth = set.images[2].power.n_azimuth(), n_range = set.images[2].power.n_range();
  std::vector<RowReference> all, block;
  for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(n_azimuth); ++row) all.push_back({2, row});
  // Eight times as many rows as the response mixes with a row to either side.
  const std::uint32_t n_block = DataTerm(set, pixel).rows_of_a_block();
  for (std::uint32_t row = 20; row < 20 + n_block; ++row) block.push_back({2, row});
  REQUIRE(20 + n_block < static_cast<std::uint32_t>(n_azimuth));
  const std::vector<LayoverShadowWindow> windows(set.images.size(), {0.0, 0.0, 0, n_range});
  const RowBatch batch = batch_of(set, block);
  const torch::Tensor at = random_pixels(batch.image.size(), 9);
  const auto loss_at = [&](const torch::Tensor& pixels) {
    DataTerm term(set, pixel);
    term.update(set, all, windows);
    return term.of(batch, pixels);
  };
  const DataLoss loss = loss_at(at);
  // At either end of the block, rows have neighbours of before.
  CHECK(loss.n_pixels == 6 * n_block / 8 * static_cast<std::size_t>(n_range));
  for (const std::int64_t n : {std::int64_t{40}, std::int64_t{3} * n_range + 40}) {
    torch::Tensor above = at.clone(), below = at.clone();
    above[n] += 0.5;
    below[n] -= 0.5;
    CHECK(loss_at(above).value - loss_at(below).value == Approx(loss.gradient[n].item<double>()).epsilon(5e-3));
  }
}

TEST_CASE("a row that comes twice has the gradient of its later rendering") {
  const TrainingSet set = speckled_ground(kGroundResolution);
  const PixelLoss pixel{1.0, 1e5};
  const std::array<RowReference, 2> twice{{{2, 20}, {2, 20}}};
  const std::array<RowReference, 1> once{{{2, 20}}};
  const RowBatch batch = batch_of(set, twice), single = batch_of(set, once);
  const torch::Tensor at = random_pixels(batch.image.size(), 9);
  const auto n = static_cast<std::int64_t>(single.image.size());
  const DataLoss both = DataTerm(set, pixel).of(batch, at), later = DataTerm(set, pixel).of(single, at.narrow(0, n, n));
  CHECK(both.value == Approx(later.value).epsilon(1e-6));
  CHECK(both.gradient.narrow(0, 0, n).abs().max().item<double>() == 0.0);
  CHECK(torch::allclose(both.gradient.narrow(0, n, n), later.gradient, 1e-4, 1e-9));
}

TEST_CASE("pixels that no voxel can change any more show the ground") {
  const TrainingSet set = speckled_ground(kGroundResolution);
  const PixelLoss pixel{1.0, 1e5};
  const std::array<RowReference, 2> rows{{{2, 20}, {2, 22}}};
  const RowBatch batch = batch_of(set, rows);
  DataTerm term(set, pixel);
  const double bare = term.of(batch_of(set, {}), torch::zeros({0})).value;
  REQUIRE(bare == 0.0);
  const std::vector<LayoverShadowWindow> all(set.images.size(), {0.0, 0.0, 0, set.images[2].power.n_range()});
  const auto value = [&] {
    DataTerm copy = term;
    RowBatch nothing = batch;
    std::fill(nothing.counts.begin(), nothing.counts.end(), std::uint8_t{0});
    return copy.of(nothing, torch::zeros({static_cast<std::int64_t>(batch.image.size())})).value;
  };
  const double ground = value();
  term.of(batch, 1e4 * random_pixels(batch.image.size(), 9).abs());
  const double bright = value();
  REQUIRE(bright != Approx(ground));
  // Both rows stay, with all of their pixels: nothing changes. Without them, the ground is left.
  term.update(set, rows, all);
  CHECK(value() == Approx(bright).epsilon(1e-6));
  term.update(set, {}, all);
  CHECK(value() == Approx(ground).epsilon(1e-9));
}

TEST_CASE("a field that is lost is found out over a ground as without one, and a black one is not lost") {
  for (const bool over_ground : {false, true}) {
    const TrainingSet set = over_ground ? speckled_ground() : small_set(4);
    const PixelLoss pixel = pixel_loss(set, default_options(set, "grid"));
    REQUIRE((pixel.relative > 0.0) == over_ground);
    const std::array<RowReference, 2> rows{{{0, 3}, {2, 4}}};
    const RowBatch batch = batch_of(set, rows);
    const torch::Tensor image = torch::tensor(batch.image);
    DataTerm term(set, pixel);
    DivergenceGuard guard(set);
    guard.check(term.of(batch, 0.99 * image), 1);
    CHECK(guard.least() > 0.0);
    guard.check(term.of(batch, torch::zeros_like(image)), 2);
    CHECK_THROWS_AS(guard.check(term.of(batch, 1e4 * image), 3), NumericsError);
    CHECK_THROWS_AS(guard.check(term.of(batch, image * std::numeric_limits<float>::quiet_NaN()), 4), NumericsError);
  }
}
