// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "console.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/nerf/model_file.h"

namespace sarnerf::app {

/// Memory of LibTorch and a program, before images, grids and models.
inline constexpr std::uint64_t kBaseMemory_bytes = 600ull << 20;

/// Limits the threads of LibTorch and of its linear algebra; ThreadLimit limits those of the native loops. If
/// LibTorch only adds up short arrays, as for the field `grid`, one thread is best: its waiting threads would take
/// the processors from the native loops.
void use_torch_threads(int n_threads);

/// Warns if this kernel depends on LibTorch's matrix products and these are slow. Measures them, because an OpenBLAS
/// that does not recognise the processor is no faster than the reference library. Cost: that of blas_gflop_per_s(),
/// nothing for the other kernels.
void warn_of_slow_blas(MlpKernel kernel, Console& console);

/// "LibTorch 1.13.1, OpenBLAS".
std::string torch_text();

/// The model's file: the path itself, or its model.pt if it is a run folder.
std::filesystem::path model_file(const std::filesystem::path& model);

/// The name for all output of a model: that of its run folder, or of its file if that is not called model.pt.
std::string model_name(const std::filesystem::path& model);

/// read_model() of a model's file or run folder. Warns if an older version wrote parts that are ignored now.
Model open_model(const std::filesystem::path& model, Console& console);

}  // namespace sarnerf::app
