// SPDX-License-Identifier: Apache-2.0
#include "torch_setup.h"

#include <system_error>

#include <ATen/Parallel.h>
#include <dlfcn.h>
#include <torch/version.h>

#include "output_lock.h"
#include "sarnerf/nerf/mlp_network.h"

namespace sarnerf::app {

namespace {

/// The library for matrix products, recognised by a function that only it has.
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
  // LibTorch refuses a second call.
  static const bool first = (at::set_num_interop_threads(1), true);
  (void)first;
  // OpenBLAS with its own threads ignores LibTorch's setting. Whether it is there depends on what the user installed.
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

namespace {

constexpr const char* kModel = "model.pt";

}  // namespace

std::filesystem::path model_file(const std::filesystem::path& model) {
  std::error_code ignored;
  return std::filesystem::is_directory(model, ignored) ? model / kModel : model;
}

std::string model_name(const std::filesystem::path& model) {
  const std::filesystem::path full = full_path(model);
  return (full.filename() == kModel ? full.parent_path().filename() : full.stem()).string();
}

Model open_model(const std::filesystem::path& model, Console& console) {
  const std::filesystem::path file = model_file(model);
  Model read = read_model(file);
  if (!read.ignored.empty())
    console.warning(file.string() + ": was written by an older version and holds " + read.ignored +
                    ", which are ignored: views are what the field renders");
  return read;
}

}  // namespace sarnerf::app
