// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "console.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/nerf/model_file.h"

namespace sarnerf::app {

/// Caps LibTorch's threads and those of its linear algebra; the native loops have theirs (ThreadLimit). Where LibTorch
/// only adds up short arrays, as for the field `grid`, one is best: its waiting threads would take the processors from
/// the native loops.
void use_torch_threads(int n_threads);

/// Warns where a network that is evaluated so depends on LibTorch's matrix products and these are slow: they are
/// measured, as an OpenBLAS that does not know the processor is no better than the reference library. Cost: that of
/// blas_gflop_per_s(), nothing for the other kernels.
void warn_of_slow_blas(MlpKernel kernel, Console& console);

/// "LibTorch 1.13.1, OpenBLAS".
std::string torch_text();

/// The model's file: what was named, or the model.pt of the run folder that was.
std::filesystem::path model_file(const std::filesystem::path& model);

/// What is made of a model is called by the run's name, or by that of a model file elsewhere.
std::string model_name(const std::filesystem::path& model);

/// read_model() of a model's file or run folder, with a warning where an older version wrote what is ignored now.
Model open_model(const std::filesystem::path& model, Console& console);

}  // namespace sarnerf::app
