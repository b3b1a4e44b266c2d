// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "shared_options.h"

namespace sarnerf::app {

/// Builds a program's parser and reads the command line with it: help and version to stdout, `--config`
/// (TOML) filling in what the command line leaves open, and every complaint as one UsageError or, for
/// the configuration file itself, InputError.
class CommandLine {
 public:
  CommandLine(std::string name, std::string description);

  CLI::App& parser() { return parser_; }

  /// Options that say the same thing differently: on the command line, one of them keeps the others out
  /// even when the configuration file sets them. Contradictions inside one source remain the caller's.
  void same_meaning(std::vector<std::string> long_names);

  /// Adds --threads, --max-memory, -q, -v, --config, --version. Call last: help shows them last.
  void add_shared_options();

  /// False when help or version was asked for and has been printed.
  bool parse(int argc, char** argv);

  /// After parse().
  SharedOptions shared_options() const;

 private:
  CLI::App parser_;
  std::string threads_ = "auto", max_memory_ = "none";
  bool quiet_ = false;
  int verbose_ = 0;
};

}  // namespace sarnerf::app
