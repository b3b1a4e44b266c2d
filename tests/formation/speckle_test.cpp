// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "catch.h"
#include "sarnerf/core/units.h"
#include "sarnerf/formation/image_formation.h"
#include "geometry/acquisitions.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr int kSide = 256;
constexpr double kSpacing_m = 0.202;

ImageFormation mstar(double looks, std::uint64_t seed) {
  ImageFormation f;
  f.resolution_m = {0.305, 0.305};
  f.window = window_from_text("taylor:-35");
  f.looks = looks;
  f.seed = seed;
  return f;
}

/// Image of a constant, without the borders that miss power from beyond.
std::vector<std::vector<double>> homogeneous(const ImageFormation& f, float beta0, int margin = 24) {
  const int n = kSide + 2 * margin;
  Image<float> image(n, n, beta0);
  form_image(image, f, view_of(40.0, 1e4, n, n, kSpacing_m), 0.0);
  std::vector<std::vector<double>> rows(kSide, std::vector<double>(kSide));
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) rows[std::size_t(i)][std::size_t(j)] = image(i + margin, j + margin);
  }
  return rows;
}

/// Correlation of intensities at a lag along one axis, |R|² with R = ∫ W² cos 2πut du / ∫ W² du.
double intensity_correlation(const ImageFormation& f, int lag) {
  if (!f.resolution_m) return lag == 0 ? 1.0 : 0.0;
  const Taper taper(f.window);
  const double t = lag * kSpacing_m * taper.broadening() / f.resolution_m->first;
  double numerator = 0.0, energy = 0.0;
  constexpr int kSteps = 2000;
  for (int n = 0; n < kSteps; ++n) {
    const double u = (n + 0.5) / kSteps - 0.5, w2 = taper.weight(u) * taper.weight(u);
    numerator += w2 * std::cos(2.0 * kPi * u * t);
    energy += w2;
  }
  return std::pow(numerator / energy, 2);
}

/// Number of independent samples to which the pixels amount: their number over the area of correlation.
double independent_samples(const ImageFormation& f) {
  double area = 1.0;
  for (int lag = 1; lag <= 8; ++lag) area += 2.0 * intensity_correlation(f, lag);
  return kSide * kSide / (area * area);
}

struct Moments {
  double mean = 0.0, variance = 0.0;
  double looks() const { return mean * mean / variance; }
};

Moments moments(const std::vector<std::vector<double>>& rows) {
  Moments m;
  for (const auto& row : rows) {
    for (const double p : row) m.mean += p;
  }
  m.mean /= kSide * kSide;
  for (const auto& row : rows) {
    for (const double p : row) m.variance += (p - m.mean) * (p - m.mean);
  }
  m.variance /= kSide * kSide - 1;
  return m;
}

/// √N times the largest distance between the samples' distribution and that of a gamma of unit mean and
/// L looks, L whole: F(x) = 1 − e^{−Lx} Σ_{k<L} (Lx)^k / k!.
double kolmogorov_smirnov(std::vector<double> samples, int looks) {
  std::sort(samples.begin(), samples.end());
  const double n = double(samples.size());
  double largest = 0.0;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const double x = looks * samples[s];
    double term = std::exp(-x), tail = 0.0;
    for (int k = 0; k < looks; ++k) {
      tail += term;
      term *= x / (k + 1);
    }
    largest = std::max({largest, std::abs(1.0 - tail - double(s) / n), std::abs(1.0 - tail - double(s + 1) / n)});
  }
  return largest * std::sqrt(n);
}

/// The value that √N D exceeds once in a thousand times for true samples.
constexpr double kOneInAThousand = 1.95;
/// Standard deviations that a fixed seed may be off.
constexpr double kDeviations = 4.0;

}  // namespace

TEST_CASE("weights of looks: unit sum, and the equivalent number asked for", "[speckle]") {
  for (const double looks : {1.0, 1.0001, 1.5, 2.0, 2.9, 4.0, 4.3, 17.0, 999.5}) {
    const auto weights = look_weights(looks);
    CHECK(weights.size() == std::size_t(std::ceil(looks)));
    double total = 0.0, squares = 0.0;
    for (const double w : weights) {
      CHECK(w >= 0.0);
      total += w;
      squares += w * w;
    }
    CHECK(total == Approx(1.0).epsilon(1e-12));
    CHECK(1.0 / squares == Approx(looks).epsilon(1e-12));
  }
}

TEST_CASE("a homogeneous area keeps its mean and has the looks asked for", "[speckle]") {
  for (const double looks : {1.0, 1.5, 4.0}) {
    for (const bool correlated : {false, true}) {
      ImageFormation f = mstar(looks, 11);
      if (!correlated) {
        f.resolution_m.reset();
        f.window = {};
      }
      const Moments m = moments(homogeneous(f, 0.2f));
      const double n = independent_samples(f);
      INFO("looks " << looks << (correlated ? ", correlated" : "") << ": " << n << " independent samples, mean "
                    << m.mean << ", looks found " << m.looks());
      // The mean of n gamma variables scatters by 1/√(nL); the moment estimate of L by L √(2(1 + 1/L)/n).
      CHECK(std::abs(m.mean / 0.2 - 1.0) < kDeviations / std::sqrt(n * looks) + 1e-4);
      CHECK(std::abs(m.looks() / looks - 1.0) < kDeviations * std::sqrt(2.0 * (1.0 + 1.0 / looks) / n));
    }
  }
}

TEST_CASE("intensities are gamma distributed", "[speckle]") {
  for (const int looks : {1, 4}) {
    ImageFormation f = mstar(looks, 5);
    // At every eighth pixel correlation has vanished: 1,024 samples. White speckle: all pixels.
    std::vector<double> apart, all;
    const auto correlated = homogeneous(f, 1.0f);
    for (int i = 0; i < kSide; i += 8) {
      for (int j = 0; j < kSide; j += 8) apart.push_back(correlated[std::size_t(i)][std::size_t(j)]);
    }
    f.resolution_m.reset();
    f.window = {};
    for (const auto& row : homogeneous(f, 1.0f)) all.insert(all.end(), row.begin(), row.end());
    const double of_apart = kolmogorov_smirnov(apart, looks), of_all = kolmogorov_smirnov(all, looks);
    INFO("looks " << looks << ": correlated " << of_apart << ", white " << of_all);
    CHECK(of_apart < kOneInAThousand);
    CHECK(of_all < kOneInAThousand);
    // The test can tell: it refuses another number of looks.
    CHECK(kolmogorov_smirnov(all, looks + 1) > 5.0);
  }
}

TEST_CASE("speckle is correlated by the impulse response", "[speckle]") {
  for (const char* window : {"taylor:-35", "none", "hann"}) {
    ImageFormation f = mstar(1.0, 3);
    f.window = window_from_text(window);
    if (f.window.kind == Window::Kind::hann) f.resolution_m = {0.4, 0.4};
    const auto rows = homogeneous(f, 1.0f);
    const Moments m = moments(rows);
    const double deviation = kDeviations * std::sqrt(2.0 / independent_samples(f));
    for (int lag = 1; lag <= 4; ++lag) {
      double along_azimuth = 0.0, along_range = 0.0;
      for (int a = 0; a + lag < kSide; ++a) {
        for (int b = 0; b < kSide; ++b) {
          const auto p = std::size_t(a), q = std::size_t(a + lag), r = std::size_t(b);
          along_azimuth += (rows[p][r] - m.mean) * (rows[q][r] - m.mean);
          along_range += (rows[r][p] - m.mean) * (rows[r][q] - m.mean);
        }
      }
      const double norm = m.variance * (kSide - lag) * kSide;
      const double theory = intensity_correlation(f, lag);
      INFO(window << ", lag " << lag << ": " << along_azimuth / norm << " and " << along_range / norm
                  << ", theory " << theory << " within " << deviation);
      CHECK(std::abs(along_azimuth / norm - theory) < deviation);
      CHECK(std::abs(along_range / norm - theory) < deviation);
    }
  }
}

TEST_CASE("the noise floor has its level in sigma0, up to the borders, and is speckle itself", "[speckle]") {
  for (const double looks : {1.0, 3.0}) {
    ImageFormation f = mstar(looks, 21);
    f.nesz_db = -17.0;
    const Acquisition a = view_of(40.0, 1e4, kSide, kSide, kSpacing_m);
    Image<float> image(kSide, kSide);
    form_image(image, f, a, 0.0);
    std::vector<std::vector<double>> rows(kSide, std::vector<double>(kSide));
    double border = 0.0;
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        const double sine = std::sqrt(1.0 - std::pow(a.altitude_m() / a.range_m(j), 2));
        rows[std::size_t(i)][std::size_t(j)] = image(i, j) * sine;
        if (i == 0 || j == 0) border += image(i, j) * sine / (2 * kSide - 1);
      }
    }
    const Moments m = moments(rows);
    const double n = independent_samples(f);
    INFO("mean " << 10.0 * std::log10(m.mean) << " dB, border " << 10.0 * std::log10(border) << " dB, looks "
                 << m.looks());
    const double db_deviation = 10.0 / std::log(10.0) / std::sqrt(n * looks);
    CHECK(std::abs(10.0 * std::log10(m.mean) + 17.0) < kDeviations * db_deviation);
    CHECK(std::abs(m.looks() / looks - 1.0) < kDeviations * std::sqrt(2.0 * (1.0 + 1.0 / looks) / n));
    CHECK(10.0 * std::log10(border) == Approx(-17.0).margin(1.2));
  }
}

TEST_CASE("the mean of many images is the image without speckle", "[speckle]") {
  const int n = 24;
  Image<float> scene(n, n, 0.02f);
  scene(7, 9) = 40.0f;
  for (int j = 12; j < 20; ++j) scene(15, j) = 3.0f;
  const Acquisition a = view_of(40.0, 1e4, n, n, kSpacing_m);
  Image<float> mean = scene, speckled = scene;
  ImageFormation f = mstar(400.0, 1);
  f.nesz_db = -15.0;
  form_image(speckled, f, a, 0.0);
  f.looks = INFINITY;
  form_image(mean, f, a, 0.0);
  double worst = 0.0;
  for (std::size_t k = 0; k < mean.pixels().size(); ++k) {
    worst = worse(worst, std::abs(double(speckled.pixels()[k]) / mean.pixels()[k] - 1.0));
  }
  // 576 pixels of 400 looks each: standard deviation 5 %.
  CHECK(worst < 0.05 * 4.5);
}
