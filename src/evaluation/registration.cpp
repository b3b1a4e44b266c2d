// SPDX-License-Identifier: Apache-2.0
// Registers views to one another (correlation with turned neighbours, and a least-squares fit of shifts to all correlations), and
// a prediction to its truth.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/core/error.h"
#include "sarnerf/evaluation/baseline.h"
#include "sarnerf/evaluation/evaluation.h"
#include "view_interpolation.h"

namespace sarnerf {

namespace {

/// Rounds of correlation. Each turns the neighbours with the shifts that the round before has found.
constexpr int kRounds = 3;

/// Standard deviation (pixels) of the amplitudes' blur. Speckle is as wide and must not decide the correlation.
constexpr double kBlur_pixels = 1.0;

/// Standard deviation (pixels) of the position of a correlation's maximum; it is weighed against the prior's.
constexpr double kNoise_pixels = 0.2;

Image<float> blurred_amplitude(const Image<float>& power) { return gaussian_blur(amplitude_of(power), kBlur_pixels); }

/// Correlation coefficient of image(i, j) with reference(i + di, j + dj) where both exist.
double correlation(const Image<float>& image, const Image<float>& reference, int di, int dj) {
  const int n_i = image.n_azimuth(), n_j = image.n_range();
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (int i = std::max(0, -di); i < std::min(n_i, n_i - di); ++i)
    for (int j = std::max(0, -dj); j < std::min(n_j, n_j - dj); ++j) {
      const double x = double{image(i, j)}, y = double{reference(i + di, j + dj)};
      n += 1.0, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
    }
  const double variance = (aa - a * a / n) * (bb - b * b / n);
  return variance > 0.0 ? (ab - a * b / n) / std::sqrt(variance) : 0.0;
}

/// Offset (pixels) of the largest correlation, refined by a parabola along each axis; 0 where it lies at the border.
std::array<double, 2> best_offset(const Image<float>& image, const Image<float>& reference, int reach) {
  const int side = 2 * reach + 1;
  std::vector<double> c(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  const auto at = [&](int di, int dj) -> double& {
    return c[static_cast<std::size_t>((di + reach) * side + dj + reach)];
  };
  int i = 0, j = 0;
  for (int di = -reach; di <= reach; ++di)
    for (int dj = -reach; dj <= reach; ++dj) {
      at(di, dj) = correlation(image, reference, di, dj);
      if (at(di, dj) > at(i, j) || (di == -reach && dj == -reach)) i = di, j = dj;
    }
  if (std::abs(i) == reach || std::abs(j) == reach) return {0.0, 0.0};
  return {i + top_of_parabola(at(i - 1, j), at(i, j), at(i + 1, j)), j + top_of_parabola(at(i, j - 1), at(i, j), at(i, j + 1))};
}

/// Each view's neighbours in azimuth, at its pitch, as indices of images.
std::vector<std::vector<std::size_t>> neighbours_of(std::span<const PosedImage> images) {
  std::vector<std::vector<std::size_t>> neighbours(images.size());
  for (const Pitch& pitch : pitches(checked_views(images)))
    for (const PosedImage* view : pitch.views) {
      Pitch others = pitch;
      std::erase(others.views, view);
      if (others.views.empty()) continue;
      for (const Neighbour& n : nearest_azimuths(others, view->acquisition))
        neighbours[static_cast<std::size_t>(view - images.data())].push_back(static_cast<std::size_t>(n.view - images.data()));
    }
  return neighbours;
}

/// Shifts s that minimise Σ (s_v − ⟨s⟩_neighbours − b_v)² / σ² + Σ s_v² / prior².
/// Conjugate gradients on the normal equations.
std::vector<double> agreeing_shifts(const std::vector<std::vector<std::size_t>>& neighbours, const std::vector<double>& b,
                                    double prior_pixels) {
  const std::size_t n = b.size();
  const double ridge = kNoise_pixels * kNoise_pixels / (prior_pixels * prior_pixels);
  const auto differences = [&](const std::vector<double>& s) {
    std::vector<double> d(n);
    for (std::size_t v = 0; v < n; ++v) {
      double mean = 0.0;
      for (const std::size_t u : neighbours[v]) mean += s[u] / static_cast<double>(neighbours[v].size());
      d[v] = neighbours[v].empty() ? 0.0 : s[v] - mean;
    }
    return d;
  };
  const auto transposed = [&](const std::vector<double>& d) {
    std::vector<double> s(n);
    for (std::size_t v = 0; v < n; ++v) {
      if (neighbours[v].empty()) continue;
      s[v] += d[v];
      for (const std::size_t u : neighbours[v]) s[u] -= d[v] / static_cast<double>(neighbours[v].size());
    }
    return s;
  };
  const auto dot = [](const std::vector<double>& x, const std::vector<double>& y) {
    double sum = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k) sum += x[k] * y[k];
    return sum;
  };
  std::vector<double> s(n), r = transposed(b), p = r;
  double rr = dot(r, r);
  for (std::size_t k = 0; k < 2 * n && rr > 1e-20; ++k) {
    std::vector<double> ap = transposed(differences(p));
    for (std::size_t v = 0; v < n; ++v) ap[v] += ridge * p[v];
    const double step = rr / dot(p, ap);
    for (std::size_t v = 0; v < n; ++v) s[v] += step * p[v], r[v] -= step * ap[v];
    const double next = dot(r, r);
    for (std::size_t v = 0; v < n; ++v) p[v] = r[v] + next / rr * p[v];
    rr = next;
  }
  return s;
}

}  // namespace

void register_views(std::span<PosedImage> images, double prior_pixels, double plane_height_m, const Monitor& monitor) {
  if (images.empty()) return;
  const int reach = std::max(2, static_cast<int>(std::ceil(3.0 * prior_pixels)));
  const std::vector<std::vector<std::size_t>> neighbours = neighbours_of(images);
  std::vector<Image<float>> amplitude(images.size());
  parallel_for(images.size(), 1,
               [&](std::size_t v, std::size_t, int) { amplitude[v] = blurred_amplitude(images[v].power); });
  for (PosedImage& image : images) image.acquisition.azimuth_shift_m = image.acquisition.range_shift_m = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> azimuth(images.size()), range(images.size());
    parallel_for(images.size(), 1, [&](std::size_t v, std::size_t, int) {
      monitor.check();
      if (neighbours[v].empty()) return;
      Acquisition wanted = images[v].acquisition;
      wanted.azimuth_shift_m = wanted.range_shift_m = 0.0;
      // Correlates pair by pair. The layover of high parts differs in each neighbour: it goes to one side in those before and to
      // the other in those after. The brightest neighbour would dominate a mean of their images.
      const double part = 1.0 / static_cast<double>(neighbours[v].size());
      for (const std::size_t u : neighbours[v]) {
        const Neighbour turned{&images[u], 1.0};
        const Image<float> reference = blurred_amplitude(weighted_mean({&turned, 1}, wanted, Warp::turn, plane_height_m));
        const std::array<double, 2> offset = best_offset(amplitude[v], reference, reach);
        const Acquisition& a = images[u].acquisition;
        azimuth[v] += part * (offset[0] - a.azimuth_shift_m / wanted.azimuth_spacing_m);
        range[v] += part * (offset[1] - a.range_shift_m / wanted.range_spacing_m);
      }
    });
    const std::vector<double> di = agreeing_shifts(neighbours, azimuth, prior_pixels),
                              dj = agreeing_shifts(neighbours, range, prior_pixels);
    for (std::size_t v = 0; v < images.size(); ++v) {
      Acquisition& a = images[v].acquisition;
      a.azimuth_shift_m = di[v] * a.azimuth_spacing_m;
      a.range_shift_m = dj[v] * a.range_spacing_m;
    }
    remove_common_translation(images);
  }
}

// Registration of a prediction to its truth.

namespace {

constexpr int kBlock_pixels = 16, kMostShift_pixels = 2, kLanczos = 4;

bool is_even(int i, int j) { return (i / kBlock_pixels + j / kBlock_pixels) % 2 == 0; }

/// Lanczos weights of samples −3 to 4 for the position `part`, in [0, 1), after sample 0, normalised to sum 1.
std::array<double, 2 * kLanczos> lanczos_weights(double part) {
  const auto sinc = [](double x) { return x == 0.0 ? 1.0 : std::sin(kPi * x) / (kPi * x); };
  std::array<double, 2 * kLanczos> weights{};
  double sum = 0.0;
  for (int n = 0; n < 2 * kLanczos; ++n) {
    const double x = part - (n - kLanczos + 1);
    weights[static_cast<std::size_t>(n)] = sinc(x) * sinc(x / kLanczos);
    sum += weights[static_cast<std::size_t>(n)];
  }
  for (double& w : weights) w /= sum;
  return weights;
}

/// image(i + di, j + dj), with the border repeated.
Image<float> shifted(const Image<float>& image, double di, double dj) {
  const int n_i = image.n_azimuth(), n_j = image.n_range();
  const int whole_i = static_cast<int>(std::floor(di)), whole_j = static_cast<int>(std::floor(dj));
  const auto of_i = lanczos_weights(di - whole_i), of_j = lanczos_weights(dj - whole_j);
  Image<float> along(n_i, n_j), both(n_i, n_j);
  const auto tap = [](int at, int n, int count) { return std::clamp(at + n - kLanczos + 1, 0, count - 1); };
  for (int i = 0; i < n_i; ++i)
    for (int j = 0; j < n_j; ++j) {
      double sum = 0.0;
      for (int n = 0; n < 2 * kLanczos; ++n) sum += of_j[static_cast<std::size_t>(n)] * double{image(i, tap(j + whole_j, n, n_j))};
      along(i, j) = static_cast<float>(sum);
    }
  for (int i = 0; i < n_i; ++i)
    for (int j = 0; j < n_j; ++j) {
      double sum = 0.0;
      for (int n = 0; n < 2 * kLanczos; ++n) sum += of_i[static_cast<std::size_t>(n)] * double{along(tap(i + whole_i, n, n_i), j)};
      both(i, j) = static_cast<float>(sum);
    }
  return both;
}

}  // namespace

RegisteredScores score_registered(const Image<float>& power, const PosedImage& truth, double peak) {
  const int n_i = power.n_azimuth(), n_j = power.n_range();
  if (n_i != truth.power.n_azimuth() || n_j != truth.power.n_range() || !(peak > 0.0) || std::max(n_i, n_j) <= kBlock_pixels)
    throw UsageError(truth.name + ": a registered score needs images of one size, of more than 16 pixels, and a positive peak");
  const Image<float> wanted = amplitude_of(truth.power), given = amplitude_of(power);
  double di = 0.0, dj = 0.0, least = std::numeric_limits<double>::infinity();
  for (int a = -kMostShift_pixels; a <= kMostShift_pixels; ++a)
    for (int b = -kMostShift_pixels; b <= kMostShift_pixels; ++b) {
      double squares = 0.0;
      for (int i = 0; i < n_i; ++i)
        for (int j = 0; j < n_j; ++j) {
          if (!is_even(i, j)) continue;
          const double e = double{given(std::clamp(i + a, 0, n_i - 1), std::clamp(j + b, 0, n_j - 1))} - double{wanted(i, j)};
          squares += e * e;
        }
      if (squares >= least) continue;
      least = squares;
      di = a;
      dj = b;
    }
  constexpr int kSteps = 6;
  for (int step = 0; step < kSteps; ++step) {
    const Image<float> now = amplitude_of(shifted(power, di, dj));
    double aa = 0.0, ab = 0.0, bb = 0.0, ae = 0.0, be = 0.0;
    for (int i = 1; i + 1 < n_i; ++i)
      for (int j = 1; j + 1 < n_j; ++j) {
        if (!is_even(i, j)) continue;
        const double a = 0.5 * (double{now(i + 1, j)} - double{now(i - 1, j)}), b = 0.5 * (double{now(i, j + 1)} - double{now(i, j - 1)});
        const double e = double{now(i, j)} - double{wanted(i, j)};
        aa += a * a, ab += a * b, bb += b * b, ae += a * e, be += b * e;
      }
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 1e-12 * aa * bb)) break;
    di = std::clamp(di - (bb * ae - ab * be) / determinant, -double(kMostShift_pixels), double(kMostShift_pixels));
    dj = std::clamp(dj - (aa * be - ab * ae) / determinant, -double(kMostShift_pixels), double(kMostShift_pixels));
  }
  const Image<float> best = shifted(power, di, dj), amplitude = amplitude_of(best);
  double of_power = 0.0, of_amplitude = 0.0, n = 0.0;
  for (int i = 0; i < n_i; ++i)
    for (int j = 0; j < n_j; ++j) {
      if (is_even(i, j)) continue;
      const double p = double{best(i, j)} - double{truth.power(i, j)}, a = double{amplitude(i, j)} - double{wanted(i, j)};
      of_power += p * p;
      of_amplitude += a * a;
      n += 1.0;
    }
  const auto psnr = [&](double largest, double squares) {
    return squares > 0.0 ? std::min(kMostPsnr_db, 10.0 * std::log10(largest * largest * n / squares)) : kMostPsnr_db;
  };
  return {psnr(peak, of_power), psnr(std::sqrt(peak), of_amplitude)};
}

}  // namespace sarnerf
