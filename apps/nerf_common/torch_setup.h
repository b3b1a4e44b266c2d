// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace sarnerf::app {

/// Caps LibTorch's threads and those of its linear algebra; the native loops have theirs (ThreadLimit). Where LibTorch
/// only adds up short arrays, as for the field `grid`, one is best: its waiting threads would take the processors from
/// the native loops.
void use_torch_threads(int n_threads);

/// Whether LibTorch multiplies matrices with the distribution's reference library, forty times slower than OpenBLAS.
bool has_slow_blas();

/// "LibTorch 1.13.1, OpenBLAS".
std::string torch_text();

}  // namespace sarnerf::app
