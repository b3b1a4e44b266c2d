// SPDX-License-Identifier: Apache-2.0
#include "torch_setup.h"

#include <ATen/Parallel.h>
#include <dlfcn.h>
#include <torch/version.h>

#include "sarnerf/nerf/blas_check.h"

namespace sarnerf::app {
namespace {

/// The library for matrix products, by a function that it alone has.
const char* blas_name() {
  constexpr const char* kLibraries[][2] = {{"OpenBLAS", "openblas_set_num_threads"},
                                           {"MKL", "MKL_Set_Num_Threads"},
                                           {"BLIS", "bli_thread_set_num_threads"}};
  for (const auto& [name, function] : kLibraries) {
    if (dlsym(RTLD_DEFAULT, function) != nullptr) return name;
  }
  return "reference BLAS";
}

}  // namespace

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

void warn_of_slow_blas(MlpKernel kernel, Console& console) {
  if (kernel != MlpKernel::plain) return;
  if (const std::string text = slow_blas_warning(blas_gflop_per_s()); !text.empty())
    console.warning(text);
}

std::string torch_text() {
  return std::string("LibTorch " TORCH_VERSION ", ") + blas_name();
}

}  // namespace sarnerf::app
