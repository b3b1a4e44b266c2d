// SPDX-License-Identifier: Apache-2.0
#include "sharpened.h"

#include <algorithm>

#include "image_tensor.h"
#include "response_matrix.h"

namespace sarnerf {
namespace {

constexpr int kIterations = 300;

/// Of the largest pixel.
constexpr float kTail = 1e-4f;

/// Power below which a quotient of two says nothing, of the image's largest.
constexpr float kFaintest = 1e-12f;

torch::Tensor without_response(const torch::Tensor& image, const ResponseMatrix& response) {
  const float faintest = kFaintest * image.max().item<float>();
  if (!(faintest > 0.0f)) return torch::zeros_like(image);
  const torch::Tensor kept = response.of(torch::ones_like(image));
  torch::Tensor sharp = torch::full_like(image, image.mean().item<float>());
  for (int n = 0; n < kIterations; ++n)
    sharp = sharp * response.of(image / response.of(sharp).clamp_min(faintest)) / kept;
  return sharp;
}

}  // namespace

std::vector<PosedImage> sharpened(const std::vector<PosedImage>& images, const Resolution& resolution) {
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
