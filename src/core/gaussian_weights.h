// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace sarnerf {

/// exp(−d²/2σ²) at n places a pixel apart, d from their middle; of sum 1.
std::vector<double> gaussian_weights(std::size_t n, double sigma_pixels);

}  // namespace sarnerf
