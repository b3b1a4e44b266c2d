// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace sarnerf::app {

/// The reader behind --config: a TOML file without sections, with the names of the options (and of the
/// positional in lower case), values as numbers, true or false, texts, or arrays of them for lists. It does
/// not lean on CLI11's own reader, which differs from version to version and does not say where it failed.
/// Each complaint is an InputError that names file and line.
class ConfigFile : public CLI::ConfigTOML {
 public:
  explicit ConfigFile(const CLI::App& parser) : parser_(parser) {}

  void same_meaning(std::vector<std::string> long_names) {
    groups_.push_back(std::move(long_names));
  }

  /// Called after the command line has been read. Leaves out what the command line says in other words.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  bool overruled(const std::string& name) const;
  std::string file() const;

  const CLI::App& parser_;
  std::vector<std::vector<std::string>> groups_;
};

}  // namespace sarnerf::app
