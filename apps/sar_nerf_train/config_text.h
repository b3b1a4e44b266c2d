// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <tuple>

#include "options.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf::app {

/// config.toml: every option that the result depends on, defaults written out, so that --config repeats the run whatever
/// another version's defaults are. Threads, memory limit and places are no part of it.
std::string config_text(const Options& options, const TrainerOptions& training);

/// How a run's config.toml differs from the wanted one, in one line; empty where it does not. Without `with_length`,
/// --steps and --time are passed over. Throws InputError for a file that is no configuration.
std::string config_difference(const std::filesystem::path& found, const std::string& wanted,
                              bool with_length);

/// smooth_density, smooth_source and smooth_angular of a run's config.toml; nothing where they are not all there. Throws
/// InputError for a file that is no configuration.
std::optional<std::tuple<double, double, double>> smoothness_in(const std::filesystem::path& found);

}  // namespace sarnerf::app
