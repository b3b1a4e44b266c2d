// SPDX-License-Identifier: Apache-2.0
#define SARNERF_KERNEL_NAMESPACE mlp_amx
#include "mlp_tiles_amx.h"

#include "mlp_kernel_body.h"
