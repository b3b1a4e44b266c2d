// SPDX-License-Identifier: Apache-2.0
// The network's kernels for one instruction set. CMake compiles this file once for each set, with the compiler's options
// for it and its name as SARNERF_KERNEL_NAMESPACE.
#ifdef SARNERF_MLP_TILES_AMX
#include "mlp/kernel/mlp_tiles_amx.h"
#else
#include "mlp/kernel/mlp_tiles_avx512.h"
#endif

#include "mlp/kernel/mlp_kernel_body.h"
