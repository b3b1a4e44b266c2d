// SPDX-License-Identifier: Apache-2.0
#include "config_file.h"

#include <algorithm>

namespace sarnerf::app {

bool ConfigFile::overruled(const std::string& name) const {
  return std::any_of(groups_.begin(), groups_.end(), [&](const auto& group) {
    return std::find(group.begin(), group.end(), name) != group.end() &&
           std::any_of(group.begin(), group.end(), [&](const std::string& other) {
             return parser_.get_option("--" + other)->count() > 0;
           });
  });
}

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  std::vector<CLI::ConfigItem> kept;
  for (CLI::ConfigItem& item : CLI::ConfigTOML::from_config(input)) {
    if (overruled(item.name)) continue;
    if (item.inputs.size() > 1) item.inputs = {CLI::detail::join(item.inputs, ",")};
    kept.push_back(std::move(item));
  }
  return kept;
}

}  // namespace sarnerf::app
