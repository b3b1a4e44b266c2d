// SPDX-License-Identifier: Apache-2.0
#define SARNERF_KERNEL_NAMESPACE kernel_avx2
#include "kernel_body.h"
