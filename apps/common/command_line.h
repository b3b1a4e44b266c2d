// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <set>
#include <string>
#include <vector>

#include "process.h"

namespace sarnerf::app {

/// Builds a program's parser and reads the command line with it: help and version to stdout, `--config`
/// (TOML) filling in what the command line leaves open, and every complaint as one UsageError or, for
/// the configuration file itself, InputError.
class CommandLine {
 public:
  CommandLine(std::string name, std::string description);

  CLI::App& parser() { return parser_; }

  /// Title under which help shows the options that are added from now on.
  void begin_group(std::string title) { group_ = std::move(title); }

  /// An option that keeps its text as given; what the text holds now is shown as its default, unless empty.
  CLI::Option* add_text_option(const char* name, std::string& text, const char* type, const char* help);
  CLI::Option* add_flag(const char* name, bool& flag, const char* help);

  /// Options that say the same thing differently: on the command line, one of them keeps the others out
  /// even when the configuration file sets them. Contradictions inside one source remain the caller's.
  void same_meaning(std::vector<std::string> long_names);

  /// Adds --threads, --max-memory, -q, -v, --config, --version. Call last: help shows them last.
  void add_shared_options();

  /// False when help or version was asked for and has been printed. An option without text is an error.
  bool parse(int argc, char** argv);

  /// After parse(): long names, without dashes, of the options that were given, here or in the configuration file.
  std::set<std::string> given() const;

  /// After parse().
  SharedOptions shared_options() const;

 private:
  CLI::App parser_;
  std::string group_;
  std::string threads_ = "auto", max_memory_ = "auto";
  bool quiet_ = false;
  int verbose_ = 0;
};

/// One of these names; the help says so in words of the option's own.
CLI::Validator one_of(const std::vector<std::string>& names);

}  // namespace sarnerf::app
