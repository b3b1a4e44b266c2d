// SPDX-License-Identifier: Apache-2.0
// The kernels for one instruction set. CMake compiles this file once for each set, with the compiler's options for it and
// its name as SARNERF_KERNEL_NAMESPACE.
#include "kernel_body.h"
