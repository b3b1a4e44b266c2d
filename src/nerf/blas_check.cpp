// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/blas_check.h"

#include <torch/types.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>

namespace sarnerf {
namespace {

constexpr std::int64_t kSide = 512;
constexpr double kSlow_gflop_per_s = 20.0;

}  // namespace

double blas_gflop_per_s() {
  using Clock = std::chrono::steady_clock;
  const torch::NoGradGuard no_grad;
  const torch::Tensor a = torch::ones({kSide, kSide}), b = torch::ones({kSide, kSide});
  torch::Tensor c = torch::empty({kSide, kSide});
  double least_s = std::numeric_limits<double>::infinity();
  for (int n = 0; n < 3; ++n) {
    const auto start = Clock::now();
    torch::mm_out(c, a, b);
    least_s = std::min(least_s, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return 2e-9 * static_cast<double>(kSide * kSide * kSide) / least_s;
}

std::string slow_blas_warning(double gflop_per_s) {
  if (gflop_per_s >= kSlow_gflop_per_s) return {};
  char text[320];
  std::snprintf(
      text, sizeof text,
      "matrix products run at %.1f GFLOP/s, a tuned BLAS reaches 50 or more a thread: install "
      "libopenblas0-pthread; if it is installed and takes this processor for an older one, set "
      "OPENBLAS_CORETYPE=SkylakeX (with AVX-512) or Haswell before the program starts",
      gflop_per_s);
  return text;
}

}  // namespace sarnerf
