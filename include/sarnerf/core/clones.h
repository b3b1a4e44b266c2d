// SPDX-License-Identifier: Apache-2.0
#pragma once

// For loops over samples: one build serves all processors, and the loader picks the clone.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SARNERF_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SARNERF_CLONES
#endif
