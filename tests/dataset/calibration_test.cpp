// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/posed_image.h"

#include <cmath>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

using namespace sarnerf;

namespace {

Acquisition view_at(double incidence_deg, double altitude_m) {
  Acquisition a;
  a.incidence_rad = rad_from_deg(incidence_deg);
  a.slant_range_m = slant_range_from_altitude_m(altitude_m, a.incidence_rad);
  a.aim_m = {500000.0, 120.0, -4e6};
  a.n_azimuth = 2;
  a.n_range = 101;
  a.azimuth_spacing_m = a.range_spacing_m = 1.0;
  return a;
}

}  // namespace

TEST_CASE("at the aim point sigma0 and gamma0 follow from the incidence there") {
  for (const double incidence_deg : {20.0, 35.0, 45.0, 70.0}) {
    const Acquisition a = view_at(incidence_deg, 10000.0);
    Image<float> sigma0(2, 101, 2.0f), gamma0(2, 101, 2.0f), beta0(2, 101, 2.0f);
    CHECK(calibrate(beta0, a, 120.0, Calibration::beta0) == 0);
    CHECK(calibrate(sigma0, a, 120.0, Calibration::sigma0) == 0);
    CHECK(calibrate(gamma0, a, 120.0, Calibration::gamma0) == 0);
    CHECK(beta0(0, 50) == 2.0f);
    CHECK(sigma0(1, 50) == Approx(2.0 * std::sin(a.incidence_rad)).epsilon(1e-6));
    CHECK(gamma0(1, 50) == Approx(2.0 * std::tan(a.incidence_rad)).epsilon(1e-6));
  }
}

TEST_CASE("off the aim point incidence follows from range and height over the reference plane") {
  const Acquisition a = view_at(20.0, 1000.0);
  const double reference_m = 100.0, height_m = 1020.0;
  Image<float> image(2, 101, 1.0f);
  CHECK(calibrate(image, a, reference_m, Calibration::sigma0) == 6);
  for (int j = 0; j < 101; ++j) {
    const double cosine = height_m / a.range_m(j);
    const double expected = cosine < 1.0 ? std::sqrt(1.0 - cosine * cosine) : 0.0;
    CHECK(image(1, j) == Approx(expected).epsilon(1e-6));
  }
}

TEST_CASE("calibration refuses what has no meaning") {
  Image<float> image(2, 101, 1.0f);
  CHECK_THROWS_AS(calibrate(image, view_at(45, 1000), 2000.0, Calibration::sigma0), GeometryError);
  CHECK_THROWS_AS(calibrate(image, view_at(45, 1000), 0.0, Calibration::uncalibrated), UsageError);
  CHECK_THROWS_AS(calibration_from_name("sigma"), UsageError);
  CHECK(calibration_from_name("gamma0") == Calibration::gamma0);
  CHECK(quantity_from_name(name(Quantity::amplitude)) == Quantity::amplitude);
}

TEST_CASE("amplitude is the root of power") {
  Image<float> image(1, 2);
  image(0, 0) = 4.0f;
  take_amplitude(image);
  CHECK(image(0, 0) == 2.0f);
  CHECK(image(0, 1) == 0.0f);
}
