// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "catch.h"
#include "posed_images.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/evaluation/baseline.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

glm::dvec2 seen_at_m(const Acquisition& a, const glm::dvec3& world_m) {
  const RadarPoint p = project(a, radar_frame(a), world_m);
  return {p.along_track_m, p.range_offset_m};
}

/// The spot at ground_m (east, south of the aim point), from view to wanted.
glm::dvec2 moved_m(const Acquisition& view, const Acquisition& wanted, glm::dvec2 ground_m,
                   Interpolation method) {
  const glm::dvec3 world = view.aim_m + glm::dvec3(ground_m.x, 0.0, ground_m.y);
  const std::vector<PosedImage> training = {spot(view, world)};
  return centroid_m(wanted, interpolate_view(training, wanted, method));
}

}  // namespace

TEST_CASE("turning moves what lies on the plane to where the wanted radar sees it") {
  struct Pair {
    Acquisition view, wanted;
  };
  Acquisition left = seen_from(75);
  left.look = Look::left;
  Acquisition finer = seen_from(300, 60);
  finer.n_azimuth = 90;
  finer.n_range = 110;
  finer.azimuth_spacing_m = 0.21;
  finer.range_spacing_m = 0.19;
  const Pair pairs[] = {{seen_from(0), seen_from(5)},
                        {seen_from(10), seen_from(140)},
                        {seen_from(60), left},
                        {left, seen_from(90)},
                        {seen_from(0, 35), seen_from(30, 60)},
                        {seen_from(330, 50), finer}};
  for (const Pair& pair : pairs) {
    for (const glm::dvec2 ground :
         {glm::dvec2(2.5, 1.5), glm::dvec2(-3.0, 2.0), glm::dvec2(0.0, -3.0)}) {
      for (const auto method : {Interpolation::rotated_linear, Interpolation::rotated_bilinear}) {
        CAPTURE(pair.view.azimuth_rad, pair.wanted.azimuth_rad, ground.x, ground.y);
        const glm::dvec2 found = moved_m(pair.view, pair.wanted, ground, method);
        const glm::dvec3 world = pair.view.aim_m + glm::dvec3(ground.x, 0.0, ground.y);
        const glm::dvec2 expected = seen_at_m(pair.wanted, world);
        CHECK(glm::length(found - expected) < 0.005);
      }
    }
  }
  // The test would notice a rotation that does nothing.
  CHECK(glm::length(moved_m(seen_from(0), seen_from(90), {3.0, 0.0}, Interpolation::linear) -
                    seen_at_m(seen_from(90), seen_from(0).aim_m + glm::dvec3(3.0, 0.0, 0.0))) >
        2.0);
}

TEST_CASE("turning is exact at every pixel for brightness that is a plane over the ground") {
  const auto brightness = [](const Acquisition& a, int i, int j) {
    const RadarFrame frame = radar_frame(a);
    const double height = a.altitude_m(), range = a.range_m(j);
    const double ground =
        std::sqrt(range * range - height * height) - a.slant_range_m * std::sin(a.incidence_rad);
    const glm::dvec3 away = glm::normalize(glm::dvec3(frame.k.x, 0.0, frame.k.z));
    const glm::dvec3 p = a.row_offset_m(i) * frame.h + ground * away;
    return 50.0 + 0.7 * p.x - 0.4 * p.z;
  };
  // From 60 m wave fronts are strongly curved, and the brightness is no longer a plane between pixels of the image.
  for (const auto& [slant_range_m, most] : {std::pair(2000.0, 1e-4), std::pair(60.0, 2e-3)}) {
    Acquisition view = seen_from(0, 40), wanted = seen_from(35, 50);
    view.slant_range_m = wanted.slant_range_m = slant_range_m;
    PosedImage image = flat(view, 0.0f);
    for (int i = 0; i < view.n_azimuth; ++i) {
      for (int j = 0; j < view.n_range; ++j)
        image.power(i, j) = static_cast<float>(brightness(view, i, j));
    }
    const Image<float> turned =
        interpolate_view(std::vector{image}, wanted, Interpolation::rotated_linear);
    double worst = 0.0;
    for (int i = 12; i < 28; ++i) {
      for (int j = 14; j < 34; ++j) {
        worst = worse(worst, std::abs(double(turned(i, j)) - brightness(wanted, i, j)));
      }
    }
    CAPTURE(slant_range_m);
    CHECK(worst < most);
  }
}

TEST_CASE("rescaling changes range alone, by the ratio of the sines") {
  const Acquisition view = seen_from(0, 35), wanted = seen_from(50, 60);
  const glm::dvec3 world = view.aim_m + glm::dvec3(2.0, 0.0, -4.0);
  const glm::dvec2 before = centroid_m(view, spot(view, world).power);
  const glm::dvec2 after = centroid_m(
      wanted,
      interpolate_view(std::vector{spot(view, world)}, wanted, Interpolation::rescaled_linear));
  CHECK(after.x == Approx(before.x).margin(0.002));
  CHECK(after.y == Approx(before.y * std::sin(wanted.incidence_rad) / std::sin(view.incidence_rad))
                       .epsilon(0.01));
}

TEST_CASE("bins nearer than the plane see nothing of it, and an unturned view keeps them") {
  Acquisition near = seen_from(0, 20);
  near.slant_range_m = 15.0;  // the plane begins 14.1 m away, the first bin lies 5.6 m away
  const std::vector<PosedImage> training = {flat(near, 1.0f)};
  Acquisition turned = near;
  turned.azimuth_rad = 0.4;
  const Image<float> image = interpolate_view(training, turned, Interpolation::rotated_linear);
  CHECK(image(20, 5) == 0.0f);
  CHECK(image(20, 24) == Approx(1.0f));
  CHECK(interpolate_view(training, near, Interpolation::rotated_linear)(20, 5) == 1.0f);
}

TEST_CASE("turning about a plane above the ground moves what lies on it to where it is seen") {
  const Acquisition view = seen_from(350, 40), wanted = seen_from(25, 52);
  for (const double height_m : {-2.0, 3.5}) {
    const glm::dvec3 world = view.aim_m + glm::dvec3(1.5, height_m, -2.0);
    const std::vector<PosedImage> training = {spot(view, world)};
    const auto moved = [&](double plane_height_m) {
      return centroid_m(wanted, interpolate_view(training, wanted, Interpolation::rotated_linear,
                                                 plane_height_m));
    };
    CHECK(glm::length(moved(height_m) - seen_at_m(wanted, world)) < 0.005);
    CHECK(glm::length(moved(0.0) - seen_at_m(wanted, world)) > 0.3);
  }
}

TEST_CASE("the height of the plane is found from the training images alone") {
  for (const double height_m : {-3.0, 0.0, 4.0}) {
    std::vector<PosedImage> training;
    for (int n = 0; n < 15; ++n) {
      const Acquisition a = seen_from(24.0 * n);
      training.push_back(spot(a, a.aim_m + glm::dvec3(2.0, height_m, 1.0)));
    }
    CAPTURE(height_m);
    CHECK(fitted_plane_height_m(training) == Approx(height_m).margin(0.06));
  }
  CHECK(fitted_plane_height_m(std::vector{noise(seen_from(0), 1)}) == 0.0);
  CHECK(fitted_plane_height_m(std::vector{flat(seen_from(0), 0.0f), flat(seen_from(9), 0.0f)}) ==
        0.0);
  // Copies predict each other at any height.
  CHECK(fitted_plane_height_m(std::vector{noise(seen_from(0), 1), noise(seen_from(0), 1)}) == 0.0);
  CHECK_THROWS_AS(fitted_plane_height_m(std::vector<PosedImage>{}), UsageError);
}

TEST_CASE("cubic interpolation is exact for polynomials of degree two, and has the kernel of Keys up to two pixels beyond the border") {
  const auto value = [](double i, double j) { return 2.0 + 0.3 * i - 0.2 * j + 0.05 * i * i - 0.04 * i * j + 0.01 * j * j; };
  Image<float> image(9, 11);
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 11; ++j) image(i, j) = static_cast<float>(value(i, j));
  for (const auto& [i, j] : {std::pair(4.0, 5.0), std::pair(3.25, 6.5), std::pair(1.9, 8.1), std::pair(7.0, 9.0)})
    CHECK(cubic(image, i, j) == Approx(value(i, j)).epsilon(1e-6));
  for (const auto& [i, j] : {std::pair(-2.0, 5.0), std::pair(4.0, 12.0), std::pair(std::nan(""), 5.0)}) CHECK(cubic(image, i, j) == 0.0);
  Image<float> impulse(9, 11);
  impulse(0, 5) = 1.0f;
  for (const auto& [i, expected] : {std::pair(-1.5, -0.0625), std::pair(-0.5, 0.5625), std::pair(0.0, 1.0), std::pair(0.25, 0.8671875), std::pair(1.5, -0.0625)})
    CHECK(cubic(impulse, i, 5.0) == Approx(expected));
}

TEST_CASE("cubic resampling of amplitude smooths speckle less than bilinear resampling of power") {
  // Speckle of one look, about as rough as that of MSTAR's chips (0.57).
  constexpr int kSide = 128;
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  Image<float> parts[2] = {Image<float>(kSide, kSide), Image<float>(kSide, kSide)};
  for (Image<float>& part : parts) {
    for (float& x : part.pixels()) x = normal(random);
    part = gaussian_blur(part, 0.75);
  }
  PosedImage speckle{"speckle", seen_from(0.0), Image<float>(kSide, kSide)};
  speckle.acquisition.n_azimuth = speckle.acquisition.n_range = kSide;
  for (std::size_t p = 0; p < speckle.power.pixels().size(); ++p)
    speckle.power.pixels()[p] = parts[0].pixels()[p] * parts[0].pixels()[p] + parts[1].pixels()[p] * parts[1].pixels()[p];
  // Mean square difference of neighbours' amplitudes over twice their variance: 1 without correlation.
  const auto roughness = [](const Image<float>& power) {
    double n = 0.0, sum = 0.0, squares = 0.0, differences = 0.0;
    for (int i = kSide / 4; i < 3 * kSide / 4; ++i)
      for (int j = kSide / 4; j < 3 * kSide / 4; ++j) {
        const double a = std::sqrt(power(i, j)), next = std::sqrt(power(i, j + 1));
        n += 1.0, sum += a, squares += a * a, differences += (next - a) * (next - a);
      }
    return differences / n / (2.0 * (squares / n - sum * sum / (n * n)));
  };
  Acquisition wanted = speckle.acquisition;
  wanted.azimuth_rad += 0.2;
  const auto turned = [&](Resampling resampling) {
    return roughness(interpolate_view(std::vector{speckle}, wanted, Interpolation::rotated_linear, 0.0, resampling));
  };
  const double measured = roughness(speckle.power);
  const double lost_by_cubic = measured - turned(Resampling::cubic), lost_by_bilinear = measured - turned(Resampling::bilinear);
  CHECK(lost_by_bilinear > 0.2 * measured);
  CHECK(lost_by_cubic > 0.0);
  CHECK(lost_by_cubic < 0.6 * lost_by_bilinear);

  const Image<float> same = interpolate_view(std::vector{speckle}, speckle.acquisition, Interpolation::rotated_linear, 0.0, Resampling::cubic);
  for (std::size_t p = 0; p < same.pixels().size(); p += 97) CHECK(same.pixels()[p] == Approx(speckle.power.pixels()[p]).epsilon(1e-5));
}
