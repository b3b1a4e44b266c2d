// SPDX-License-Identifier: Apache-2.0
#include "response_matrix.h"

#include <cstdlib>
#include <map>
#include <tuple>

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

}  // namespace sarnerf
