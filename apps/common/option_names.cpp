// SPDX-License-Identifier: Apache-2.0
#include "option_names.h"

#include "sarnerf/core/closest_name.h"

namespace sarnerf::app {

std::vector<std::string> option_names(const CLI::App& parser) {
  std::vector<std::string> names;
  for (const CLI::Option* option : parser.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
    if (option->get_positional()) names.push_back(CLI::detail::to_lower(option->get_name(true)));
  }
  return names;
}

const CLI::Option* find_positional(const CLI::App& parser, const std::string& lower_name) {
  for (const CLI::Option* option : parser.get_options()) {
    if (option->get_positional() && CLI::detail::to_lower(option->get_name(true)) == lower_name) return option;
  }
  return nullptr;
}

std::string did_you_mean(const CLI::App& parser, const std::string& unknown, const std::string& dashes) {
  const std::string close = closest_name(unknown, option_names(parser));
  return close.empty() ? "" : " (" + dashes + close + "?)";
}

}  // namespace sarnerf::app
