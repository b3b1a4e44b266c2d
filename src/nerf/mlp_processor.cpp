// SPDX-License-Identifier: Apache-2.0
// What this processor and the system offer to the fused kernels.
#include "mlp_plan.h"

#ifdef SARNERF_MLP_KERNELS
#include <cpuid.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace sarnerf {
namespace {

#ifdef SARNERF_MLP_KERNELS
bool has_avx512_bf16() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
         __builtin_cpu_supports("avx512bf16");
}

/// Linux gives the tile registers, 8 KiB a thread in each signal frame, only to a process that asks.
bool has_amx_bf16() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned kBf16 = 1u << 22, kTile = 1u << 24;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(d & kBf16) || !(d & kTile)) return false;
  constexpr long kRequestPermission = 0x1023, kTileData = 18;
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}
#endif

MlpKernel best_of_processor() {
#ifdef SARNERF_MLP_KERNELS
  static const MlpKernel best = !has_avx512_bf16() ? MlpKernel::plain
                                : has_amx_bf16()   ? MlpKernel::amx_bf16
                                                   : MlpKernel::avx512_bf16;
  return best;
#else
  return MlpKernel::plain;
#endif
}

}  // namespace

MlpKernel best_mlp_kernel(const MlpShape& shape) {
  return fused_kernels_fit(shape) ? best_of_processor() : MlpKernel::plain;
}

}  // namespace sarnerf
