// SPDX-License-Identifier: Apache-2.0
#include "recipe_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/input_text.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr const char* kFormat = "sarnerf-recipe";
constexpr int kFormatVersion = 1;
constexpr std::size_t kMaxDifferences = 3;

void collect_differences(const Json& found, const Json& wanted, const std::string& place,
                         std::vector<std::string>& list) {
  if (found == wanted) return;
  if (!found.is_object() || !wanted.is_object()) {
    const auto shortened = [](const Json& j) {
      std::string text = j.is_null() ? "nothing" : j.dump();
      return text.size() > 48 ? text.substr(0, 45) + "..." : text;
    };
    list.push_back(place + ": " + shortened(found) + " there, " + shortened(wanted) + " now");
    return;
  }
  const auto member = [](const Json& object, const std::string& key) {
    return object.contains(key) ? object.at(key) : Json();
  };
  const std::string prefix = place.empty() ? "" : place + ".";
  for (const auto& [key, value] : wanted.items()) {
    collect_differences(member(found, key), value, prefix + key, list);
  }
  for (const auto& [key, value] : found.items()) {
    if (!wanted.contains(key)) collect_differences(value, Json(), prefix + key, list);
  }
}

}  // namespace

Json valid_text(const Json& json) {
  return Json::parse(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

Json make_recipe(const std::string& program, const Json& request, const Json& resolved) {
  return valid_text({{"format", kFormat},
                     {"version", kFormatVersion},
                     {"program", program + " " + std::string(kVersion)},
                     {"request", request},
                     {"resolved", resolved}});
}

std::optional<Json> read_recipe(const std::filesystem::path& path) {
  std::string text;
  try {
    text = read_whole_file(path);
    require_shallow_json(text, path.string());
  } catch (const InputError&) {
    return std::nullopt;
  }
  Json recipe = Json::parse(text, nullptr, false);
  if (!recipe.is_object() || recipe.value("format", Json()) != kFormat) return std::nullopt;
  return recipe;
}

std::string recipe_text(const Json& recipe) { return recipe.dump(2) + "\n"; }

std::string difference(const Json& found, const Json& wanted) {
  std::vector<std::string> list;
  collect_differences(found, wanted, "", list);
  std::string text;
  for (std::size_t n = 0; n < std::min(kMaxDifferences, list.size()); ++n) {
    text += (n > 0 ? "; " : "") + list[n];
  }
  if (list.size() > kMaxDifferences) {
    text += "; and " + std::to_string(list.size() - kMaxDifferences) + " more";
  }
  return text;
}

}  // namespace sarnerf::app
