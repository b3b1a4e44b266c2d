// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/formation/image_formation.h"

#include <cmath>
#include <cstring>
#include <numeric>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "geometry/acquisitions.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

ImageFormation resolution(double azimuth_m, double range_m, const char* window) {
  ImageFormation f;
  f.resolution_m = {azimuth_m, range_m};
  f.window = window_from_text(window);
  return f;
}

Acquisition view(int n_azimuth, int n_range, double spacing_m) {
  return view_of(40.0, 1e4, n_azimuth, n_range, spacing_m);
}

Image<float> formed(Image<float> image, const ImageFormation& f, const Acquisition& a) {
  form_image(image, f, a, 0.0);
  return image;
}

bool same_bytes(const Image<float>& a, const Image<float>& b) {
  return a.pixels().size() == b.pixels().size() &&
         std::memcmp(a.pixels().data(), b.pixels().data(), a.pixels().size_bytes()) == 0;
}

/// Half-power width (pixels) of a peak in a row, between samples by the parabola of logarithms.
double width_pixels(const std::vector<double>& row, std::size_t peak) {
  const auto crossing = [&](int step) {
    std::size_t n = peak;
    const double half = 0.5 * row[peak];
    while (row[n] > half) n += static_cast<std::size_t>(step);
    const std::size_t before = n - static_cast<std::size_t>(step);
    const double inner = std::log(row[before]), outer = std::log(row[n]);
    return std::abs(double(before) - double(peak)) + (inner - std::log(half)) / (inner - outer);
  };
  return crossing(1) + crossing(-1);
}

}  // namespace

TEST_CASE("off: the image is left alone, to the bit", "[formation]") {
  Image<float> image(5, 7);
  for (std::size_t n = 0; n < image.pixels().size(); ++n) image.pixels()[n] = 0.1f * float(n) - 0.5f;
  const Image<float> before = image;
  ImageFormation off;
  off.seed = 7;
  CHECK_FALSE(off.any());
  CHECK(formation_bytes_per_pixel(off) == 0);
  // Not even the size is looked at.
  CHECK(form_image(image, off, {}, 0.0) == 0);
  CHECK(same_bytes(image, before));
}

TEST_CASE("a constant keeps its mean where no border is in reach", "[formation]") {
  for (const char* window : {"hann", "hamming", "kaiser:6", "taylor:-35", "none"}) {
    const ImageFormation f = resolution(0.305, 0.4, window);
    const ImpulseResponse h = impulse_response(f, 0.2, 0.2);
    const int ra = h.azimuth.reach(), rr = h.range.reach();
    const Acquisition a = view(2 * ra + 3, 2 * rr + 4, 0.2);
    const Image<float> image = formed(Image<float>(a.n_azimuth, a.n_range, 0.37f), f, a);
    INFO(window << ", taps to " << ra << " and " << rr);
    for (int i = ra; i < ra + 3; ++i) {
      for (int j = rr; j < rr + 4; ++j) CHECK(image(i, j) == Approx(0.37f).epsilon(1e-6));
    }
    // Beyond the borders it is dark.
    const double half = h.range.energy_inside(0, a.n_range);
    CHECK(half > 0.5);
    CHECK(half < 0.9);
    CHECK(image(ra, 0) == Approx(0.37 * half).epsilon(1e-6));
    CHECK(image(0, 0) == Approx(0.37 * half * h.azimuth.energy_inside(0, a.n_azimuth)).epsilon(1e-6));
  }
}

TEST_CASE("a point target has the resolution asked for and the window's sidelobes", "[formation]") {
  for (const char* window : {"none", "hann", "hamming", "taylor:-35", "kaiser:6"}) {
    const Taper taper(window_from_text(window));
    const ImageFormation f = resolution(1.0, 1.6, window);
    const int n = 401;
    const Acquisition a = view(n, n, 0.05);
    Image<float> image(n, n);
    image(n / 2, n / 2) = 3.0f;
    image = formed(std::move(image), f, a);
    std::vector<double> row(n), column(n);
    for (int k = 0; k < n; ++k) {
      row[std::size_t(k)] = image(n / 2, k);
      column[std::size_t(k)] = image(k, n / 2);
    }
    INFO(window);
    CHECK(width_pixels(column, n / 2) * 0.05 == Approx(1.0).epsilon(2e-3));
    CHECK(width_pixels(row, n / 2) * 0.05 == Approx(1.6).epsilon(2e-3));
    std::size_t k = n / 2;
    while (column[k + 1] < column[k]) ++k;
    double highest = 0.0;
    for (; k < std::size_t(n); ++k) highest = std::max(highest, column[k]);
    CHECK(10.0 * std::log10(highest / column[n / 2]) ==
          Approx(taper.peak_sidelobe_db()).margin(0.1));
  }
}

TEST_CASE("what leaks over a border is lost, not wrapped, and comes back from a larger image",
          "[formation]") {
  const ImageFormation f = resolution(0.5, 0.5, "hamming");
  const Acquisition small = view(24, 20, 0.2), large = view(64, 60, 0.2);
  Image<float> image(24, 20), whole(64, 60);
  image(0, 19) = 2.0f;
  image(13, 4) = 1.0f;
  whole(20, 39) = 2.0f;
  whole(33, 24) = 1.0f;
  image = formed(std::move(image), f, small);
  whole = formed(std::move(whole), f, large);
  for (int i = 0; i < 24; ++i) {
    for (int j = 0; j < 20; ++j) CHECK(image(i, j) == whole(i + 20, j + 20));
  }
  CHECK(std::accumulate(image.pixels().begin(), image.pixels().end(), 0.0) < 2.5);
  CHECK(image(23, 0) < 1e-6f);
}

TEST_CASE("a target of 120 dB leaves its neighbourhood's power exact", "[formation]") {
  const ImageFormation f = resolution(0.5, 0.5, "hann");
  const Acquisition a = view(301, 301, 0.25);
  const int reach = impulse_response(f, 0.25, 0.25).range.reach();
  REQUIRE(reach < 80);
  Image<float> image(301, 301, 1.0f);
  image(150, 150) = 1e12f;
  image = formed(std::move(image), f, a);
  double total = 0.0;
  for (int i = 150 - reach; i <= 150 + reach; ++i) {
    for (int j = 150 - reach; j <= 150 + reach; ++j) total += image(i, j);
  }
  CHECK(total == Approx(1e12).epsilon(1e-6));
  CHECK(image(150, 150 + reach + 1) == Approx(1.0).epsilon(1e-6));
  CHECK(image(30, 40) == Approx(1.0).epsilon(1e-6));
  CHECK(image(150 + reach + 1, 150 - reach) == Approx(1.0).epsilon(1e-6));
}

TEST_CASE("the noise's mean is added where there is no speckle", "[formation]") {
  ImageFormation f;
  f.nesz_db = -23.0;
  const Acquisition a = view(3, 64, 0.2);
  Image<float> image = formed(Image<float>(3, 64, 0.25f), f, a);
  for (int j = 0; j < 64; ++j) {
    const double sine = std::sqrt(1.0 - std::pow(a.altitude_m() / a.range_m(j), 2));
    const double nesz = (image(1, j) - 0.25) * sine;
    CHECK(10.0 * std::log10(nesz) == Approx(-23.0).margin(1e-3));
  }
  // Bins above the nadir have no incidence. Below the plane there is no radar.
  Acquisition steep = view_of(5.0, 100.0, 2, 64, 0.2);
  Image<float> near(2, 64);
  const int without = form_image(near, f, steep, 0.0);
  CHECK(without > 0);
  CHECK(near(0, without - 1) == 0.0f);
  CHECK(near(0, without) > 0.0f);
  CHECK_THROWS_AS(form_image(near, f, steep, 200.0), GeometryError);
}

TEST_CASE("what has no image is refused", "[formation]") {
  const auto refused = [](const ImageFormation& f) {
    CHECK_THROWS_AS(validate(f, 0.2, 0.2), UsageError);
  };
  ImageFormation f;
  CHECK_NOTHROW(validate(f, 0.2, 0.2));
  for (const double looks : {0.0, 0.99, -1.0, 1001.0, std::nan(""), double(-INFINITY)}) {
    f.looks = looks;
    refused(f);
  }
  f = {};
  for (const double level : {std::nan(""), double(INFINITY), 301.0}) {
    f.nesz_db = level;
    refused(f);
  }
  f = {};
  f.window = window_from_text("hann");
  refused(f);
  refused(resolution(0.2, 0.3, "taylor:-35"));
  refused(resolution(0.3, 0.2, "taylor:-35"));
  refused(resolution(-0.3, 0.3, "none"));
  CHECK_NOTHROW(validate(resolution(0.3, 0.3, "taylor:-35"), 0.2, 0.2));
  Image<float> image(3, 4);
  CHECK_THROWS_AS(form_image(image, resolution(0.5, 0.5, "none"), view(4, 3, 0.2), 0.0), UsageError);
}

TEST_CASE("the same bytes whatever the number of threads; other ones for another seed or pose",
          "[formation]") {
  ImageFormation f = resolution(0.305, 0.305, "taylor:-35");
  f.looks = 1.5;
  f.nesz_db = -20.0;
  const Acquisition a = view(40, 50, 0.2);
  Image<float> scene(40, 50);
  for (int i = 10; i < 30; ++i) {
    for (int j = 12; j < 35; ++j) scene(i, j) = float(i + j);
  }
  Image<float> first;
  for (const int n : {1, 2, 5}) {
    const ThreadLimit limit(n);
    const Image<float> image = formed(scene, f, a);
    if (n == 1) first = image;
    CHECK(same_bytes(image, first));
  }
  f.seed = 2;
  CHECK_FALSE(same_bytes(formed(scene, f, a), first));
  f.seed = 1;
  Acquisition turned = a;
  turned.azimuth_rad += 0.1;
  CHECK_FALSE(same_bytes(formed(scene, f, turned), first));
}
