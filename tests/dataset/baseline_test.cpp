// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/baseline.h"

#include <algorithm>

#include "catch.h"
#include "posed_images.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/dataset/posed_image.h"
#include "../core/speckle.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

const glm::dvec3 kSpot = seen_from(0).aim_m + glm::dvec3(2.0, 0.0, 3.0);

/// A spot on a ground of 0.1 and speckle over both.
PosedImage speckled(double azimuth_deg, unsigned seed, int looks = 1, double incidence_deg = 45.0) {
  PosedImage image = spot(seen_from(azimuth_deg, incidence_deg), kSpot, 3.0);
  const Image<float> noise = speckle(48, looks, 0.0, seed);
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 48; ++j) image.power(i, j) = (image.power(i, j) + 0.1f) * noise(i, j);
  return image;
}

std::vector<PosedImage> sweep(double step_deg, int looks = 1) {
  std::vector<PosedImage> views;
  for (int n = 0; n * step_deg < 360.0; ++n)
    views.push_back(speckled(n * step_deg, static_cast<unsigned>(n) + 1, looks));
  return views;
}

double fluctuation(const Image<float>& image) {
  // Away from the border, where turned images end.
  double sum = 0.0, squares = 0.0;
  int n = 0;
  for (int i = 12; i < 28; ++i) {
    for (int j = 12; j < 20; ++j, ++n) {
      sum += double(image(i, j));
      squares += double(image(i, j)) * double(image(i, j));
    }
  }
  const double mean = sum / n;
  return (squares / n - mean * mean) / (mean * mean);
}

}  // namespace

TEST_CASE("the mean of six takes the six nearest in azimuth, around the circle, with equal weights") {
  // Flat images tell by their values who took part: powers of two.
  std::vector<PosedImage> views;
  const double azimuths_deg[] = {350, 10, 340, 100, 20, 30, 335, 180};
  for (int n = 0; n < 8; ++n)
    views.push_back(flat(seen_from(azimuths_deg[n]), static_cast<float>(1 << n)));
  // From 2°: 350 (12), 10 (8), 340 (22), 20 (18), 30 (28), 335 (27).
  const Image<float> image =
      interpolate_view(views, seen_from(2.0), Interpolation::rotated_mean, 0.0);
  CHECK(double(image(20, 24)) == Approx((1 + 2 + 4 + 16 + 32 + 64) / 6.0).epsilon(1e-6));
  const std::span few(views.data(), 3);
  CHECK(double(interpolate_view(few, seen_from(2.0), Interpolation::rotated_mean)(20, 24)) ==
        Approx((1 + 2 + 4) / 3.0).epsilon(1e-6));
}

TEST_CASE("of several pitches the mean takes the nearest one, or two with weights") {
  std::vector<PosedImage> views;
  for (int n = 0; n < 12; ++n) {
    views.push_back(flat(seen_from(30.0 * n, 40.0), 1.0f));
    views.push_back(flat(seen_from(30.0 * n, 50.0), 5.0f));
  }
  const Acquisition wanted = seen_from(7.0, 42.5);
  CHECK(double(interpolate_view(views, wanted, Interpolation::rotated_mean)(20, 24)) ==
        Approx(1.0).epsilon(1e-6));
  CHECK(double(interpolate_view(views, wanted, Interpolation::rotated_mean_bipitch)(20, 24)) ==
        Approx(0.75 * 1.0 + 0.25 * 5.0).epsilon(1e-6));
  CHECK(despeckling_for(views).size() == 3);
  CHECK(despeckling_for(std::span(views).first(1)).size() == 2);
  CHECK(despeckling_for({}).empty());
}

TEST_CASE("the mean of six turns its views: a spot stays where it stands") {
  std::vector<PosedImage> views;
  for (int n = 0; n < 36; ++n) views.push_back(spot(seen_from(10.0 * n), kSpot, 3.0));
  const PosedImage truth = spot(seen_from(43.0), kSpot, 3.0);
  const Image<float> image =
      interpolate_view(views, truth.acquisition, Interpolation::rotated_mean);
  const glm::dvec2 found = centroid_m(truth.acquisition, image),
                   expected = centroid_m(truth.acquisition, truth.power);
  CHECK(found.x == Approx(expected.x).margin(0.05));
  CHECK(found.y == Approx(expected.y).margin(0.05));
}

TEST_CASE("six views have a sixth of the fluctuation") {
  std::vector<PosedImage> views;
  for (unsigned n = 0; n < 72; ++n) views.push_back(noise(seen_from(5.0 * n), n + 1));
  double one = 0.0, six = 0.0;
  for (int n = 0; n < 8; ++n) {
    const Acquisition wanted = seen_from(45.0 * n + 2.5);
    one += fluctuation(views[static_cast<std::size_t>(9 * n)].power);
    // Bilinear look-ups average, too: a sixth is the most that may be left.
    six += fluctuation(interpolate_view(views, wanted, Interpolation::rotated_mean));
  }
  CHECK(six < one / 6.0);
  CHECK(six > one / 6.0 * 0.25);  // bilinear weights leave 4/9 of the variance on average
}

TEST_CASE("speckled images have two more baselines a plane, clean ones have not") {
  const auto names = [](const std::vector<Baseline>& baselines) {
    std::string text;
    for (const Baseline& b : baselines) text += name(b) + "\n";
    return text;
  };
  const std::string with = names(default_baselines(sweep(10.0)));
  CHECK(with.find("rotated, mean of six") != std::string::npos);
  CHECK(with.find("rotated, then linear, blurred by ") != std::string::npos);

  std::vector<PosedImage> clean;
  for (int n = 0; n < 36; ++n) {
    clean.push_back(spot(seen_from(10.0 * n), kSpot, 3.0));
    for (float& p : clean.back().power.pixels()) p += 0.1f;
  }
  CHECK(names(default_baselines(clean)).find("mean of six") == std::string::npos);
  CHECK(name({Interpolation::rotated_mean, 1.5, 0.7}) ==
        "rotated, mean of six, blurred by 0.7 (plane at 1.50 m)");
  CHECK(with.find(", amplitudes") != std::string::npos);
  CHECK(name({Interpolation::rotated_mean, 0.0, 0.7, true}) ==
        "rotated, mean of six, blurred by 0.7, amplitudes");
}

TEST_CASE("of amplitudes the square of the mean comes out") {
  std::vector<PosedImage> views{spot(seen_from(0.0), kSpot, 3.0), spot(seen_from(10.0), kSpot, 3.0)};
  std::fill(views[0].power.pixels().begin(), views[0].power.pixels().end(), 1.0f);
  std::fill(views[1].power.pixels().begin(), views[1].power.pixels().end(), 9.0f);
  const Acquisition wanted = seen_from(5.0);
  const auto middle = [&](bool of_amplitudes) {
    const Image<float> image =
        baseline_view(views, wanted, {Interpolation::linear, 0.0, 0.0, of_amplitudes});
    return image(image.n_azimuth() / 2, image.n_range() / 2);
  };
  CHECK(middle(false) == Approx(5.0));
  CHECK(middle(true) == Approx(4.0));
}

TEST_CASE("the blur is the one that predicts left-out views best") {
  const std::vector<PosedImage> views = sweep(10.0);
  const double chosen = fitted_blur_pixels(views, {Interpolation::rotated_linear});
  CHECK(chosen > 0.0);
  // Against clean truth, which it has not seen, it is better than none.
  const auto psnr = [&](double blur) {
    double sum = 0.0;
    for (int n = 0; n < 9; ++n) {
      PosedImage truth = spot(seen_from(40.0 * n + 5.0), kSpot, 3.0);
      for (float& p : truth.power.pixels()) p += 0.1f;
      sum += psnr_db(baseline_view(views, truth.acquisition,
                                   {Interpolation::rotated_linear, 0.0, blur}),
                     truth.power, 3.0);
    }
    return sum / 9;
  };
  CHECK(psnr(chosen) > psnr(0.0) + 1.0);

  // Fine, clean detail, the same in every view: any blur would lose it.
  std::vector<PosedImage> still;
  for (int n = 0; n < 6; ++n) {
    still.push_back(noise(seen_from(0.0), 5));
    still.back().acquisition.azimuth_rad = 0.0;
  }
  CHECK(fitted_blur_pixels(still, {Interpolation::rotated_linear}) == 0.0);
  CHECK(fitted_blur_pixels(std::span(views).first(1), {Interpolation::rotated_mean}) == 0.0);
}

TEST_CASE("a blurred baseline is the blurred view") {
  const std::vector<PosedImage> views = sweep(30.0);
  const Acquisition wanted = seen_from(41.0);
  const Image<float> expected =
      gaussian_blur(interpolate_view(views, wanted, Interpolation::rotated_mean, 0.5), 1.5);
  CHECK(same_pixels(baseline_view(views, wanted, {Interpolation::rotated_mean, 0.5, 1.5}), expected));
}

TEST_CASE("images are speckled where a visible background fluctuates") {
  CHECK(is_speckled(sweep(30.0, 1)));
  CHECK(is_speckled(sweep(30.0, 4)));
  CHECK(*looks_of(sweep(30.0, 4)) > 2.5 * *looks_of(sweep(30.0, 1)));

  // A smooth spot is positive everywhere in theory, and no background.
  const std::vector<PosedImage> object{spot(seen_from(0), kSpot, 3.0)};
  CHECK(has_background(object));
  CHECK_FALSE(has_visible_background(object));
  CHECK_FALSE(looks_of(object).has_value());
  CHECK_FALSE(is_speckled(object));

  // Ground in checks of three pixels' contrast is textured, and not speckled.
  PosedImage checks = flat(seen_from(0), 1.0f);
  for (int i = 0; i < 40; ++i)
    for (int j = 0; j < 48; ++j) checks.power(i, j) = (i / 12 + j / 12) % 2 == 0 ? 1.0f : 3.0f;
  CHECK(has_visible_background(std::span(&checks, 1)));
  CHECK_FALSE(is_speckled(std::span(&checks, 1)));
  CHECK_FALSE(is_speckled({}));
}
