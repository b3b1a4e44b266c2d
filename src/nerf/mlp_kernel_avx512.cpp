// SPDX-License-Identifier: Apache-2.0
#define SARNERF_KERNEL_NAMESPACE mlp_avx512
#include "mlp_tiles_avx512.h"

#include "mlp_kernel_body.h"
