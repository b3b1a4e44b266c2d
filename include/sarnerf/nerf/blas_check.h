// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace sarnerf {

/// Billions of additions and multiplications a second of a float32 product of 512 × 512 matrices, the fastest of
/// three, in LibTorch's threads. Cost: some milliseconds where BLAS is fast, 0.2 s where it is not.
double blas_gflop_per_s();

/// What to tell a user whose BLAS is slow: empty at 20 GFLOP/s or more. LibTorch's distribution packages
/// do with a reference BLAS that is forty times slower than a tuned one, and OpenBLAS takes processors newer than
/// itself for very old ones.
std::string slow_blas_warning(double gflop_per_s);

}  // namespace sarnerf
