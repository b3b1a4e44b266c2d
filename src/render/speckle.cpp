// SPDX-License-Identifier: Apache-2.0
#include "speckle.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/parallel.h"
#include "sarnerf/core/separable_filter.h"

namespace sarnerf {
namespace {

constexpr std::size_t kRowsAtOnce = 4;

struct ComplexPlane {
  ComplexPlane(int n_azimuth, int n_range) : real(n_azimuth, n_range), imaginary(n_azimuth, n_range) {}
  Plane real, imaginary;
};

/// Scratch of one worker: a complex row in double.
struct ComplexRow {
  explicit ComplexRow(int n_range)
      : real(static_cast<std::size_t>(n_range)), imaginary(static_cast<std::size_t>(n_range)) {}
  void clear() {
    std::fill(real.begin(), real.end(), 0.0);
    std::fill(imaginary.begin(), imaginary.end(), 0.0);
  }
  std::vector<double> real, imaginary;
};

/// White complex values of standard deviation deviation(i, j), filtered along range; column j of the
/// result times gain(j). Where the deviation is zero nothing is drawn.
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

/// Amplitudes per bin and row that give white unit noise, filtered without anything from beyond the
/// borders, its full power up to them.
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

}  // namespace

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

}  // namespace sarnerf
