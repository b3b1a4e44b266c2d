// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "console.h"
#include "sarnerf/nerf/mlp_network.h"

namespace sarnerf::app {

/// Caps LibTorch's threads and those of its linear algebra; the native loops have theirs (ThreadLimit). Where LibTorch
/// only adds up short arrays, as for the field `grid`, one is best: its waiting threads would take the processors from
/// the native loops.
void use_torch_threads(int n_threads);

/// Warns where a network that is evaluated so depends on LibTorch's matrix products and these are slow: they are
/// measured, as an OpenBLAS that does not know the processor is no better than the reference library. Cost: that of
/// blas_gflop_per_s(), nothing for the other kernels.
void warn_of_slow_blas(MlpKernel kernel, Console& console);

/// "LibTorch 1.13.1, OpenBLAS".
std::string torch_text();

}  // namespace sarnerf::app
