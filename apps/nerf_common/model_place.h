// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "console.h"
#include "sarnerf/nerf/model_file.h"

namespace sarnerf::app {

/// The model's file: what was named, or the model.pt of the run folder that was.
std::filesystem::path model_file(const std::filesystem::path& model);

/// What is made of a model is called by the run's name, or by that of a model file elsewhere.
std::string model_name(const std::filesystem::path& model);

/// read_model() of a model's file or run folder, with a warning where an older version wrote what is ignored now.
Model open_model(const std::filesystem::path& model, Console& console);

}  // namespace sarnerf::app
