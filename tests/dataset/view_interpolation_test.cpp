// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/baseline.h"

#include <set>

#include "catch.h"
#include "mirrored.h"
#include "posed_images.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr Interpolation kAll[] = {Interpolation::nearest,         Interpolation::linear,
                                  Interpolation::rescaled_linear, Interpolation::rotated_linear,
                                  Interpolation::bilinear,        Interpolation::rotated_bilinear};

/// What comes of flat images of different brightness: pixel in the middle, where no border is near.
double middle(const std::vector<PosedImage>& training, const Acquisition& wanted,
              Interpolation method) {
  return double(
      interpolate_view(training, wanted, method)(wanted.n_azimuth / 2, wanted.n_range / 2));
}

}  // namespace

TEST_CASE("a training view is predicted exactly, by every method") {
  std::vector<PosedImage> training;
  unsigned seed = 0;
  for (const double incidence_deg : {35.0, 47.0, 41.0}) {
    for (const double azimuth_deg : {10.0, 350.0, 123.4, 200.0}) {
      training.push_back(noise(seen_from(azimuth_deg, incidence_deg), ++seed));
    }
  }
  for (const PosedImage& view : training) {
    for (const Interpolation method : kAll) {
      CAPTURE(view.name, name(method));
      CHECK(same_pixels(interpolate_view(training, view.acquisition, method), view.power));
      Acquisition once_around = view.acquisition;
      once_around.azimuth_rad -= 2 * kPi;
      CHECK(same_pixels(interpolate_view(training, once_around, method), view.power));
    }
  }
}

TEST_CASE("weights are linear in azimuth, over gaps of any width and through north") {
  const std::vector<PosedImage> training = {flat(seen_from(200), 8.0f), flat(seen_from(-10), 1.0f),
                                            flat(seen_from(20), 4.0f)};
  for (const auto method :
       {Interpolation::linear, Interpolation::rotated_linear, Interpolation::bilinear}) {
    CAPTURE(name(method));
    CHECK(middle(training, seen_from(5), method) == Approx(2.5));
    CHECK(middle(training, seen_from(0), method) == Approx(2.0));
    CHECK(middle(training, seen_from(365), method) == Approx(2.5));
    CHECK(middle(training, seen_from(65), method) == Approx(4.0 + 4.0 * 45 / 180));
    CHECK(middle(training, seen_from(275), method) == Approx(8.0 - 7.0 * 75 / 150));
  }
  CHECK(middle(training, seen_from(4), Interpolation::nearest) == 1.0);
  CHECK(middle(training, seen_from(6), Interpolation::nearest) == 4.0);
  CHECK(middle(training, seen_from(111), Interpolation::nearest) == 8.0);
  // In the middle of a gap the first of the two is taken, not the one that rounding prefers.
  CHECK(middle(training, seen_from(5), Interpolation::nearest) == 1.0);
}

TEST_CASE("weights are linear in incidence, and the border's beyond it") {
  const std::vector<PosedImage> training = {
      flat(seen_from(0, 40), 1.0f), flat(seen_from(90, 40), 3.0f), flat(seen_from(0, 44), 5.0f),
      flat(seen_from(90, 44), 9.0f)};
  for (const auto method : {Interpolation::bilinear, Interpolation::rotated_bilinear}) {
    CAPTURE(name(method));
    CHECK(middle(training, seen_from(0, 43), method) == Approx(4.0));
    CHECK(middle(training, seen_from(45, 41), method) == Approx(0.75 * 2 + 0.25 * 7));
    CHECK(middle(training, seen_from(45, 30), method) == Approx(2.0));
    CHECK(middle(training, seen_from(45, 50), method) == Approx(7.0));
  }
  for (const auto method :
       {Interpolation::linear, Interpolation::rescaled_linear, Interpolation::rotated_linear}) {
    CAPTURE(name(method));
    CHECK(middle(training, seen_from(45, 41.9), method) == Approx(2.0));
    CHECK(middle(training, seen_from(45, 42.0), method) == Approx(2.0));
    CHECK(middle(training, seen_from(45, 42.1), method) == Approx(7.0));
  }
  CHECK(middle(training, seen_from(80, 43), Interpolation::nearest) == 9.0);
}

TEST_CASE("measured incidences that scatter are one pitch") {
  const std::vector<PosedImage> training = {
      flat(seen_from(0, 72.9), 1.0f), flat(seen_from(10, 73.1), 3.0f),
      flat(seen_from(20, 73.0), 5.0f), flat(seen_from(10, 73.02), 7.0f)};
  CHECK(interpolations_for(training).size() == 3);
  CHECK(middle(training, seen_from(15, 73.1), Interpolation::linear) == Approx(4.0));
  CHECK(middle(training, seen_from(15, 73.0), Interpolation::linear) == Approx(6.0));
  CHECK(middle(training, seen_from(10, 73.1), Interpolation::linear) == 3.0);

  std::vector<PosedImage> two = training;
  two.push_back(flat(seen_from(0, 75), 2.0f));
  const std::vector<Interpolation> methods = interpolations_for(two);
  CHECK(std::set(methods.begin(), methods.end()).size() == 6);
  CHECK(interpolations_for({}).empty());
}

TEST_CASE("one view is all that is needed") {
  const std::vector<PosedImage> training = {flat(seen_from(70), 2.0f)};
  for (const Interpolation method : kAll) {
    CAPTURE(name(method));
    CHECK(middle(training, seen_from(250, 30), method) == Approx(2.0));
  }
}

TEST_CASE("of contradictory views at one place the first counts") {
  const std::vector<PosedImage> training = {flat(seen_from(0), 2.0f), flat(seen_from(360), 6.0f)};
  for (const Interpolation method : kAll) CHECK(middle(training, seen_from(0), method) == 2.0);
}

TEST_CASE(
    "sizes, spacings and aim points differ: metres count, and beyond the border there is nothing") {
  const Acquisition coarse = seen_from(0);
  PosedImage ramp = flat(coarse, 0.0f);
  for (int i = 0; i < coarse.n_azimuth; ++i) {
    for (int j = 0; j < coarse.n_range; ++j) {
      ramp.power(i, j) =
          static_cast<float>(100.0 + 3.0 * coarse.row_offset_m(i) + 2.0 * coarse.bin_offset_m(j));
    }
  }
  Acquisition fine = coarse;
  fine.n_azimuth = 101;
  fine.n_range = 7;
  fine.azimuth_spacing_m = 0.17;
  fine.range_spacing_m = 0.23;
  const std::vector<PosedImage> training = {ramp};
  for (const Interpolation method : kAll) {
    CAPTURE(name(method));
    const Image<float> image = interpolate_view(training, fine, method);
    REQUIRE(image.n_azimuth() == 101);
    REQUIRE(image.n_range() == 7);
    // Bilinear interpolation is exact on a plane.
    for (const int i : {0, 33, 100}) {
      for (const int j : {0, 6}) {
        CHECK(
            double(image(i, j)) ==
            Approx(100.0 + 3.0 * fine.row_offset_m(i) + 2.0 * fine.bin_offset_m(j)).epsilon(1e-6));
      }
    }
    Acquisition aside = fine;
    aside.aim_m += 2.0 * radar_frame(fine).h;
    CHECK(double(interpolate_view(training, aside, method)(50, 3)) == Approx(106.0).epsilon(1e-6));
    Acquisition wide = coarse;
    wide.azimuth_spacing_m = 5.0;
    const Image<float> far = interpolate_view(training, wide, method);
    CHECK(far(0, 20) == 0.0f);
    CHECK(far(20, 20) > 0.0f);
  }
}

TEST_CASE("a radar that looks to the other side sees the rows in reverse") {
  const Acquisition right = seen_from(30, 50);
  Acquisition left = right;
  left.look = Look::left;
  const PosedImage image = noise(right, 3);
  for (const Interpolation method : kAll) {
    CAPTURE(name(method));
    CHECK(same_pixels(interpolate_view(std::vector{image}, left, method), rows_reversed(image.power)));
  }
}

TEST_CASE("what cannot be interpolated is refused") {
  const std::vector<PosedImage> none;
  CHECK_THROWS_AS(interpolate_view(none, seen_from(0), Interpolation::linear), UsageError);
  std::vector<PosedImage> bad = {flat(seen_from(0), 1.0f)};
  bad[0].acquisition.n_range = 5;
  CHECK_THROWS_AS(interpolate_view(bad, seen_from(0), Interpolation::linear), UsageError);
  bad[0] = flat(seen_from(0), 1.0f);
  CHECK_THROWS_AS(interpolate_view(bad, seen_from(0, 90), Interpolation::linear), GeometryError);
}
