// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/metrics.h"

#include <cmath>
#include <initializer_list>
#include <limits>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "speckle.h"

using namespace sarnerf;

namespace {

Image<float> row(std::initializer_list<float> values) {
  Image<float> image(1, static_cast<int>(values.size()));
  std::copy(values.begin(), values.end(), image.pixels().begin());
  return image;
}

}  // namespace

TEST_CASE("relative error: a common factor f errs by |f - 1|") {
  const Image<float> reference = row({1, 2, 3, 0});
  CHECK(relative_l2_error(reference, reference) == 0.0);
  CHECK(relative_l2_error(row({1.5f, 3, 4.5f, 0}), reference) == Approx(0.5));
  CHECK(relative_l2_error(row({0, 0, 0, 0}), reference) == Approx(1.0));
  CHECK(relative_l2_error(row({0, 0}), row({0, 0})) == 0.0);
  CHECK(std::isinf(relative_l2_error(row({1, 0}), row({0, 0}))));
}

TEST_CASE("dB error: only pixels near the peak count") {
  // The faint pixel, 40 dB below the peak, is wrong by a factor of 1000.
  const Image<float> reference = row({1, 0.1f, 0.01f, 1e-4f});
  const Image<float> image = row({2, 0.1f, 0.01f, 0.1f});
  CHECK(db_error_percentile(image, reference, 100.0) == Approx(10 * std::log10(2.0)));
  CHECK(db_error_percentile(image, reference, 100.0, 50.0) == Approx(30.0).epsilon(1e-5));
  CHECK(db_error_percentile(image, reference, 50.0) == Approx(0.0).margin(1e-5));
  CHECK(std::isinf(db_error_percentile(row({0, 0, 0, 0}), reference)));
  CHECK(db_error_percentile(image, row({0, 0, 0, 0})) == 0.0);
}

TEST_CASE("dB error: the 95th percentile leaves out exactly one pixel in twenty") {
  Image<float> reference(1, 20, 1.0f), image(1, 20, 1.0f);
  image(0, 7) = 10.0f;
  CHECK(db_error_percentile(image, reference) == Approx(0.0).margin(1e-6));
  image(0, 8) = 10.0f;
  CHECK(db_error_percentile(image, reference) == Approx(10.0));
}

TEST_CASE("PSNR: an error of a tenth of the peak everywhere is 20 dB") {
  CHECK(psnr_db(row({1.1f, 0.1f}), row({1, 0}), 1.0) == Approx(20.0).epsilon(1e-5));
  CHECK(psnr_db(row({1.1f, 0.1f}), row({1, 0}), 10.0) == Approx(40.0).epsilon(1e-5));
  CHECK(std::isinf(psnr_db(row({1}), row({1}), 1.0)));
  CHECK(capped_psnr_db(row({1}), row({1}), 1.0) == kMostPsnr_db);
  CHECK(capped_psnr_db(row({1.1f, 0.1f}), row({1, 0}), 1.0) == Approx(20.0).epsilon(1e-5));
  CHECK(std::isnan(capped_psnr_db(row({std::numeric_limits<float>::quiet_NaN()}), row({1}), 1.0)));
}

TEST_CASE("metrics refuse what cannot be compared") {
  CHECK_THROWS_AS(relative_l2_error(row({1, 2}), row({1})), UsageError);
  CHECK_THROWS_AS(db_error_percentile(row({1, 2}), row({1})), UsageError);
  CHECK_THROWS_AS(db_error_percentile(row({1}), row({1}), 101.0), UsageError);
  CHECK_THROWS_AS(psnr_db(row({1, 2}), row({1}), 1.0), UsageError);
  CHECK_THROWS_AS(psnr_db(row({1}), row({1}), 0.0), UsageError);
}

TEST_CASE("log-amplitude error: factors are decibels, and what lies below the floor is equal") {
  CHECK(log_amplitude_error_db(row({10, 1, 0.1f}), row({1, 0.1f, 0.01f}), 10.0) ==
        Approx(10.0).epsilon(1e-6));
  // 10 dB up, 10 dB down, right: √(200/3) dB.
  CHECK(log_amplitude_error_db(row({1, 0.01f, 1}), row({0.1f, 0.1f, 1}), 1.0) ==
        Approx(std::sqrt(200.0 / 3.0)).epsilon(1e-6));
  CHECK(log_amplitude_error_db(row({0, 1e-9f}), row({1e-5f, -1}), 1.0) == 0.0);
  CHECK(log_amplitude_error_db(row({0}), row({1e-3f}), 1.0) == Approx(10.0).epsilon(1e-5));
  CHECK(log_amplitude_error_db(row({0}), row({1e-3f}), 1.0, 20.0) == 0.0);
  CHECK_THROWS_AS(log_amplitude_error_db(row({1}), row({1, 1}), 1.0), UsageError);
  CHECK_THROWS_AS(log_amplitude_error_db(row({1}), row({1}), 0.0), UsageError);
  CHECK_THROWS_AS(log_amplitude_error_db(row({1}), row({1}), 1.0, 0.0), UsageError);
  CHECK_THROWS_AS(log_amplitude_error_db({}, {}, 1.0), UsageError);
}

TEST_CASE("log-amplitude error: speckle of one look has the deviation of a log-exponential variable") {
  // var ln I = π²/6 for an exponential variable of any mean; its mean is that of ln I, −γ, beside the clean image's.
  const Image<float> speckled = test::speckle(300, 1, 0.0, 8);
  const Image<float> clean(300, 300, std::exp(-0.5772157f));
  CHECK(log_amplitude_error_db(speckled, clean, 10.0, 80.0) ==
        Approx(10.0 / std::log(10.0) * M_PI / std::sqrt(6.0)).epsilon(0.01));
}
