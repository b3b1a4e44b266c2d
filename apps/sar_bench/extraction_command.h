// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "extraction.h"

namespace sarnerf::bench {

/// The sub-command `extraction`, which fills the options in.
CLI::App& add_extraction_command(CLI::App& app, ExtractionOptions& options);

/// Measures, and writes extraction.json, extraction.md and the diagrams into the output folder, anew after each run; prints
/// the table. Throws UsageError where another study is in the way.
void run_extraction_command(const ExtractionOptions& options, app::Console& console);

}  // namespace sarnerf::bench
