// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace sarnerf::app {

/// Long names of a parser's options, without dashes, and its positionals in lower case: "pitch", "scene".
std::vector<std::string> option_names(const CLI::App& parser);

/// A positional by its name in lower case; null when there is none.
const CLI::Option* find_positional(const CLI::App& parser, const std::string& lower_name);

/// " (--pitch?)", the known name nearest to an unknown one, or nothing; `dashes` goes before it.
std::string did_you_mean(const CLI::App& parser, const std::string& unknown, const std::string& dashes);

}  // namespace sarnerf::app
