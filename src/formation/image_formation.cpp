// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/formation/image_formation.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <span>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

namespace {

/// Counter-based random numbers: a pixel's value depends on its indices and the key alone, so that any
/// thread can make a row and empty pixels can be skipped. SplitMix64's finaliser
/// (Steele, Lea and Flood 2014) over a counter.
class WhiteNoise {
 public:
  explicit WhiteNoise(std::uint64_t seed) : key_(mix(seed)) {}

  /// An independent stream for each value.
  WhiteNoise stream(std::uint64_t value) const { return WhiteNoise(key_ ^ mix(value + kStep)); }
  WhiteNoise stream(double value) const { return stream(std::bit_cast<std::uint64_t>(value + 0.0)); }

  /// Complex circular Gaussian of mean 0 and unit variance, E|w|² = 1. By Box and Muller: |w|² is
  /// exponential and the phase uniform.
  std::complex<double> complex_gaussian(std::uint64_t index) const {
    const double power = -std::log(uniform(2 * index));
    return std::polar(std::sqrt(power), 2.0 * kPi * uniform(2 * index + 1));
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ull;

  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  /// Uniform in (0, 1]: never 0, whose logarithm is infinite. 1 occurs by rounding, with probability 2⁻⁵³.
  double uniform(std::uint64_t index) const {
    return (double(mix(key_ + (index + 1) * kStep) >> 11) + 0.5) * 0x1p-53;
  }

  std::uint64_t key_;
};

constexpr std::size_t kRowsAtOnce = 4;

struct ComplexPlane {
  ComplexPlane(int n_azimuth, int n_range) : real(n_azimuth, n_range), imaginary(n_azimuth, n_range) {}
  Plane real, imaginary;
};

/// Scratch of one worker: a complex row in double precision.
struct ComplexRow {
  explicit ComplexRow(int n_range)
      : real(static_cast<std::size_t>(n_range)), imaginary(static_cast<std::size_t>(n_range)) {}
  void clear() {
    std::fill(real.begin(), real.end(), 0.0);
    std::fill(imaginary.begin(), imaginary.end(), 0.0);
  }
  std::vector<double> real, imaginary;
};

/// Fills `plane` with white complex noise of standard deviation deviation(i, j), filtered along range, column j
/// times gain(j). Pixels of zero deviation are skipped.
template <class Deviation, class Gain>
void fill_along_range(ComplexPlane& plane, std::span<const double> taps, const WhiteNoise& random,
                      const Deviation& deviation, const Gain& gain, const Monitor& monitor) {
  const int n_azimuth = plane.real.values.n_azimuth(), n_range = plane.real.values.n_range();
  parallel_for(static_cast<std::size_t>(n_azimuth), kRowsAtOnce, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    ComplexRow row(n_range);
    for (std::size_t n = begin; n < end; ++n) {
      const int i = static_cast<int>(n);
      const WhiteNoise of_row = random.stream(std::uint64_t{n});
      bool used = false;
      row.clear();
      for (int j = 0; j < n_range; ++j) {
        const double d = deviation(i, j);
        if (d == 0.0) continue;
        used = true;
        const auto value = d * of_row.complex_gaussian(static_cast<std::uint64_t>(j));
        spread(value.real(), taps, j, row.real);
        spread(value.imag(), taps, j, row.imaginary);
      }
      plane.real.row_used[n] = plane.imaginary.row_used[n] = used;
      if (!used) continue;
      for (int j = 0; j < n_range; ++j) {
        const auto column = static_cast<std::size_t>(j);
        plane.real.values(i, j) = static_cast<float>(row.real[column] * gain(j));
        plane.imaginary.values(i, j) = static_cast<float>(row.imaginary[column] * gain(j));
      }
    }
  });
}

/// Gains per bin and row that give filtered white unit noise its full power up to the borders, where the filter
/// gets nothing from beyond.
struct NoiseGains {
  NoiseGains(const ImpulseResponse& response, std::span<const double> noise_power, int n_azimuth)
      : of_bin(noise_power.size()), of_row(static_cast<std::size_t>(n_azimuth)) {
    const int n_range = static_cast<int>(noise_power.size());
    for (int j = 0; j < n_range; ++j) {
      const auto column = static_cast<std::size_t>(j);
      of_bin[column] = std::sqrt(noise_power[column] / response.range.energy_inside(j, n_range));
    }
    for (int i = 0; i < n_azimuth; ++i) {
      of_row[static_cast<std::size_t>(i)] = 1.0 / std::sqrt(response.azimuth.energy_inside(i, n_azimuth));
    }
  }
  std::vector<double> of_bin, of_row;
};

/// Replaces mean power by Σ_m a_m |h ⊛ (√β⁰ w_m) + n_m|². `noise_power` holds one value per range bin; empty:
/// no noise.
void apply_speckle(Image<float>& beta0, const ImpulseResponse& response, std::span<const double> look_weights,
                   std::span<const double> noise_power, const WhiteNoise& random, const Monitor& monitor) {
  const int n_azimuth = beta0.n_azimuth(), n_range = beta0.n_range();
  const bool noisy = !noise_power.empty();
  const auto width = static_cast<std::size_t>(n_range);
  ComplexPlane field(n_azimuth, n_range), noise(noisy ? n_azimuth : 0, noisy ? n_range : 0);
  const NoiseGains gains(response, noise_power, noisy ? n_azimuth : 0);
  Image<double> power(n_azimuth, n_range);

  for (std::size_t m = 0; m < look_weights.size(); ++m) {
    const WhiteNoise look = random.stream(std::uint64_t{m});
    fill_along_range(field, response.range.taps, look.stream(std::uint64_t{0}),
                     [&](int i, int j) { return std::sqrt(double(beta0(i, j))); }, [](int) { return 1.0; },
                     monitor);
    if (noisy) {
      fill_along_range(noise, response.range.taps, look.stream(std::uint64_t{1}),
                       [](int, int) { return 1.0; },
                       [&](int j) { return gains.of_bin[static_cast<std::size_t>(j)]; }, monitor);
    }
    parallel_for(static_cast<std::size_t>(n_azimuth), kRowsAtOnce, [&](std::size_t begin, std::size_t end, int) {
      monitor.check();
      ComplexRow row(n_range), noise_row(noisy ? n_range : 0);
      for (std::size_t n = begin; n < end; ++n) {
        const int i = static_cast<int>(n);
        gather_rows(field.real, response.azimuth.taps, i, row.real);
        gather_rows(field.imaginary, response.azimuth.taps, i, row.imaginary);
        if (noisy) {
          gather_rows(noise.real, response.azimuth.taps, i, noise_row.real);
          gather_rows(noise.imaginary, response.azimuth.taps, i, noise_row.imaginary);
          for (std::size_t j = 0; j < width; ++j) {
            row.real[j] += gains.of_row[n] * noise_row.real[j];
            row.imaginary[j] += gains.of_row[n] * noise_row.imaginary[j];
          }
        }
        const std::span<double> sum = power.row(i);
        for (std::size_t j = 0; j < width; ++j) {
          sum[j] += look_weights[m] *
                    (row.real[j] * row.real[j] + row.imaginary[j] * row.imaginary[j]);
        }
      }
    });
  }
  for (std::size_t n = 0; n < power.pixels().size(); ++n) {
    beta0.pixels()[n] = static_cast<float>(power.pixels()[n]);
  }
}

constexpr double kMostLooks = 1000.0;
constexpr double kMostNoiseDb = 300.0;

/// N_j of every bin; 0 in bins without incidence.
std::vector<double> noise_power(double nesz_db, const Acquisition& acquisition, double reference_height_m) {
  const double height_m = acquisition.altitude_m() + acquisition.aim_m.y - reference_height_m;
  if (!(height_m > 0.0)) {
    throw GeometryError("a noise level in sigma0 needs a radar above the reference plane; it stands " +
                        format("%.6g", -height_m) +
                        " m below it: raise the altitude or lower --ground-height");
  }
  const double nesz = std::pow(10.0, nesz_db / 10.0);
  std::vector<double> power(static_cast<std::size_t>(acquisition.n_range), 0.0);
  for (int j = 0; j < acquisition.n_range; ++j) {
    const double cosine = height_m / acquisition.range_m(j);
    if (cosine >= 1.0) continue;
    power[static_cast<std::size_t>(j)] = nesz / std::sqrt((1.0 - cosine) * (1.0 + cosine));
  }
  return power;
}

/// All checks of validate() except the sampling, which impulse_response() checks.
void require_meaning(const ImageFormation& f) {
  if (!(f.looks >= 1.0) || (f.looks > kMostLooks && f.speckle())) {
    throw UsageError("--looks: expected a number from 1 to 1000, or inf for no speckle, found " +
                     format("%.6g", f.looks));
  }
  if (f.nesz_db && !(std::abs(*f.nesz_db) <= kMostNoiseDb)) {
    throw UsageError("--nesz: expected decibels between -300 and 300, found " +
                     format("%.6g", *f.nesz_db));
  }
  if (!f.resolution_m && f.window != Window{}) {
    throw UsageError("--window: a window shapes an impulse response: give its --resolution too, or leave the window " +
                     text_of(f.window) + " out");
  }
}

}  // namespace

void validate(const ImageFormation& formation, double azimuth_spacing_m, double range_spacing_m) {
  require_meaning(formation);
  impulse_response(formation, azimuth_spacing_m, range_spacing_m);
}

ImpulseResponse impulse_response(const ImageFormation& f, double azimuth_spacing_m, double range_spacing_m) {
  if (!f.resolution_m) return {};
  return impulse_response(Resolution{f.resolution_m->first, f.resolution_m->second, f.window}, azimuth_spacing_m,
                          range_spacing_m);
}

std::vector<double> look_weights(double looks) {
  const auto n_looks = static_cast<std::size_t>(std::ceil(looks));
  if (double(n_looks) == looks) return std::vector<double>(n_looks, 1.0 / looks);
  // k equal weights a and a last one b: k a + b = 1 and k a² + b² = 1 / looks.
  const double k = double(n_looks) - 1.0;
  const double b = (1.0 - std::sqrt(1.0 - (k + 1.0) * (1.0 - k / looks))) / (k + 1.0);
  std::vector<double> weights(n_looks, (1.0 - b) / k);
  weights.back() = b;
  return weights;
}

int form_image(Image<float>& beta0, const ImageFormation& formation, const Acquisition& acquisition,
               double reference_height_m, const Monitor& monitor) {
  if (!formation.any()) return 0;
  if (beta0.n_azimuth() != acquisition.n_azimuth || beta0.n_range() != acquisition.n_range) {
    throw UsageError("image formation: expected an image of the acquisition's " +
                     std::to_string(acquisition.n_azimuth) + " x " + std::to_string(acquisition.n_range) +
                     " pixels, found " + std::to_string(beta0.n_azimuth()) + " x " +
                     std::to_string(beta0.n_range()));
  }
  require_meaning(formation);
  const ImpulseResponse response =
      impulse_response(formation, acquisition.azimuth_spacing_m, acquisition.range_spacing_m);
  std::vector<double> noise;
  if (formation.nesz_db) noise = noise_power(*formation.nesz_db, acquisition, reference_height_m);

  if (formation.speckle()) {
    const WhiteNoise random =
        WhiteNoise(formation.seed).stream(acquisition.azimuth_rad).stream(acquisition.incidence_rad);
    apply_speckle(beta0, response, look_weights(formation.looks), noise, random, monitor);
  } else {
    if (formation.resolution_m) convolve_power(beta0, response, monitor);
    for (int i = 0; i < beta0.n_azimuth() && !noise.empty(); ++i) {
      for (std::size_t j = 0; j < noise.size(); ++j) {
        beta0.row(i)[j] = static_cast<float>(double(beta0.row(i)[j]) + noise[j]);
      }
    }
  }
  return static_cast<int>(std::count(noise.begin(), noise.end(), 0.0));
}

std::uint64_t formation_bytes_per_pixel(const ImageFormation& formation) {
  if (formation.speckle()) return sizeof(double) + (formation.nesz_db ? 4 : 2) * sizeof(float);
  return formation.resolution_m ? sizeof(float) : 0;
}

}  // namespace sarnerf
