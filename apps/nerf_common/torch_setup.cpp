// SPDX-License-Identifier: Apache-2.0
#include "torch_setup.h"

#include <ATen/Parallel.h>
#include <dlfcn.h>
#include <torch/version.h>

namespace sarnerf::app {

void use_torch_threads(int n_threads) {
  at::set_num_threads(n_threads);
  // Once only: a second call is an error to LibTorch.
  static const bool first = (at::set_num_interop_threads(1), true);
  (void)first;
  // OpenBLAS with threads of its own does not know of LibTorch's; it is there or not, as the user installed it.
  using SetThreads = void (*)(int);
  if (void* set = dlsym(RTLD_DEFAULT, "openblas_set_num_threads"))
    reinterpret_cast<SetThreads>(set)(n_threads);
}

bool has_slow_blas() {
  return dlsym(RTLD_DEFAULT, "openblas_set_num_threads") == nullptr &&
         dlsym(RTLD_DEFAULT, "MKL_Set_Num_Threads") == nullptr &&
         dlsym(RTLD_DEFAULT, "bli_thread_set_num_threads") == nullptr;
}

std::string torch_text() {
  return std::string("LibTorch " TORCH_VERSION ", ") +
         (has_slow_blas() ? "reference BLAS" : "optimised BLAS");
}

}  // namespace sarnerf::app
