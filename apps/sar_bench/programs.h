// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sarnerf::bench {

/// Another program of the same build or installation. Throws Error where it is missing.
std::filesystem::path program_beside(const std::string& name);

/// One word of a shell's line, whatever characters it has.
std::string quoted(const std::string& word);

/// Runs such a program, drops what it prints on stdout, and waits for it. Returns its exit code; throws Interrupted
/// where it was told to stop.
int run_beside(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace sarnerf::bench
