// SPDX-License-Identifier: Apache-2.0
#include "train/response.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <tuple>
#include <utility>

#include "field/tensors.h"
#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

/// [n, n + 2 border]
torch::Tensor matrix_of(const Kernel& kernel, int n, int border) {
  torch::Tensor matrix = torch::zeros({n, n + 2 * border}, torch::kFloat);
  auto entries = matrix.accessor<float, 2>();
  for (int to = 0; to < n; ++to)
    for (int from = 0; from < n + 2 * border; ++from) {
      const int apart = to + border - from;
      if (std::abs(apart) > kernel.reach()) continue;
      const double tap = kernel.taps[static_cast<std::size_t>(kernel.reach() + apart)];
      entries[to][from] = static_cast<float>(tap * tap);
    }
  return matrix;
}

}  // namespace

std::vector<std::shared_ptr<const ResponseMatrix>> response_matrices(const std::vector<PosedImage>& images,
                                                                     const Resolution& resolution) {
  std::map<std::tuple<int, int, double, double>, std::shared_ptr<const ResponseMatrix>> known;
  std::vector<std::shared_ptr<const ResponseMatrix>> matrices;
  for (const PosedImage& image : images) {
    const Acquisition& a = image.acquisition;
    auto& matrix = known[{a.n_azimuth, a.n_range, a.azimuth_spacing_m, a.range_spacing_m}];
    if (!matrix) {
      const ImpulseResponse response = impulse_response(resolution, a.azimuth_spacing_m, a.range_spacing_m);
      const Border border = border_of(response, a.n_azimuth, a.n_range);
      matrix = std::make_shared<ResponseMatrix>(
          ResponseMatrix{border, matrix_of(response.azimuth, a.n_azimuth, border.azimuth),
                         matrix_of(response.range, a.n_range, border.range).t().contiguous()});
    }
    matrices.push_back(matrix);
  }
  return matrices;
}

namespace {

constexpr int kIterations = 60;

/// Fraction of the largest pixel below which pixels are set to 0.
constexpr float kTail = 1e-4f;

/// Smallest denominator of the ratio of image to estimate, as a fraction of the image's largest pixel.
constexpr float kFaintest = 1e-12f;

/// Accelerated Richardson-Lucy: each iteration starts from an extrapolation along the last change, by a factor that the last two
/// steps determine (Biggs and Andrews 1997). Power beyond the borders that leaks in is estimated, too, and then cut off.
torch::Tensor without_response(const torch::Tensor& image, const ResponseMatrix& response) {
  const float faintest = kFaintest * image.max().item<float>();
  if (!(faintest > 0.0f)) return torch::zeros_like(image);
  const torch::Tensor kept = response.adjoint_of(torch::ones_like(image));
  torch::Tensor sharp = torch::full_like(kept, image.mean().item<float>()), before, step;
  double ahead = 0.0;
  for (int n = 0; n < kIterations; ++n) {
    const torch::Tensor from = n > 1 ? (sharp + ahead * (sharp - before)).clamp_min(0.0f) : sharp;
    before = sharp;
    sharp = from * response.adjoint_of(image / response.of(from).clamp_min(faintest)) / kept;
    const torch::Tensor last = std::exchange(step, sharp - from);
    if (n == 0) continue;
    const double square = last.square().sum().item<double>();
    ahead = square > 0.0 ? std::clamp((step * last).sum().item<double>() / square, 0.0, 1.0) : 0.0;
  }
  const Border& border = response.border;
  return sharp.narrow(0, border.azimuth, image.size(0)).narrow(1, border.range, image.size(1));
}

}  // namespace

std::vector<PosedImage> richardson_lucy(const std::vector<PosedImage>& images, const Resolution& resolution) {
  const torch::NoGradGuard no_gradients;
  const auto matrices = response_matrices(images, resolution);
  std::vector<PosedImage> sharp = images;
  float peak = 0.0f;
  for (std::size_t v = 0; v < images.size(); ++v) {
    sharp[v].power = image_of(without_response(tensor_of(images[v].power).clamp_min(0.0f), *matrices[v]));
    for (const float p : sharp[v].power.pixels()) peak = std::max(peak, p);
  }
  for (PosedImage& image : sharp)
    for (float& p : image.power.pixels())
      if (p < kTail * peak) p = 0.0f;
  return sharp;
}

}  // namespace sarnerf
