// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace sarnerf::app {

/// The TOML reader behind --config. Beyond CLI11's own it takes arrays for lists (azimuth = [0, 90])
/// and lets an option on the command line keep out those that say the same thing differently.
class ConfigFile : public CLI::ConfigTOML {
 public:
  explicit ConfigFile(const CLI::App& parser) : parser_(parser) {}

  void same_meaning(std::vector<std::string> long_names) {
    groups_.push_back(std::move(long_names));
  }

  /// Called after the command line has been read.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  bool overruled(const std::string& name) const;

  const CLI::App& parser_;
  std::vector<std::vector<std::string>> groups_;
};

}  // namespace sarnerf::app
