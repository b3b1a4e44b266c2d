// SPDX-License-Identifier: Apache-2.0
#define SARNERF_KERNEL_NAMESPACE kernel_baseline
#include "kernel_body.h"
