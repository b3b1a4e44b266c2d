// SPDX-License-Identifier: Apache-2.0
#include "config_file.h"

#include <algorithm>

#include "flat_toml.h"
#include "option_names.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {

bool ConfigFile::overruled(const std::string& name) const {
  return std::any_of(groups_.begin(), groups_.end(), [&](const auto& group) {
    return std::find(group.begin(), group.end(), name) != group.end() &&
           std::any_of(group.begin(), group.end(), [&](const std::string& other) {
             return parser_.get_option("--" + other)->count() > 0;
           });
  });
}

std::string ConfigFile::file() const {
  const CLI::Option* config = parser_.get_config_ptr();
  return config->results().empty() ? "--config" : config->results().front();
}

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  const std::string path = file();
  std::vector<CLI::ConfigItem> kept;
  for (const FlatItem& found : read_flat_toml(input, path)) {
    const std::string place = path + ":" + std::to_string(found.line) + ": ";
    const CLI::Option* option = parser_.get_option_no_throw("--" + found.name);
    CLI::ConfigItem item;
    item.name = found.name;
    if (option == nullptr) {
      option = find_positional(parser_, found.name);
      if (option == nullptr) {
        throw InputError(place + "unknown option '" + found.name + "'" + did_you_mean(parser_, found.name, "") +
                         "; expected a name that " + parser_.get_name() + " --help lists, without its dashes");
      }
      item.name = option->get_name(true);
    }
    if (!option->get_configurable()) {
      throw InputError(place + "'" + found.name + "' belongs on the command line, not into a configuration file");
    }
    const bool flag = option->get_items_expected_max() == 0;
    if (flag && (found.values.size() != 1 || (found.values[0] != "true" && found.values[0] != "false"))) {
      throw InputError(place + "'" + found.name + "': expected true or false, found '" +
                       CLI::detail::join(found.values, ",") + "'");
    }
    if (overruled(found.name)) continue;
    item.inputs = {CLI::detail::join(found.values, ",")};
    kept.push_back(std::move(item));
  }
  return kept;
}

}  // namespace sarnerf::app
