// SPDX-License-Identifier: Apache-2.0
#include "config_text.h"

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "flat_toml.h"
#include "sarnerf/core/input_file.h"
#include "version.h"

namespace sarnerf::app {
namespace {

using Json = nlohmann::ordered_json;

/// TOML's basic strings are JSON's.
std::string quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string full_path(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto full = std::filesystem::weakly_canonical(path, ignored);
  return full.empty() ? path.string() : full.string();
}

std::map<std::string, std::string> settings(const std::string& text, const std::string& where) {
  std::istringstream in(text);
  std::map<std::string, std::string> values;
  for (const FlatItem& item : read_flat_toml(in, where)) {
    for (const std::string& value : item.values) {
      const auto equals = item.name == "option" ? value.find('=') : std::string::npos;
      if (equals != std::string::npos) {
        values["option " + value.substr(0, equals)] = value.substr(equals + 1);
      } else {
        values[item.name] = value;
      }
    }
  }
  return values;
}

}  // namespace

std::string config_text(const Options& o, const TrainerOptions& training) {
  std::ostringstream out;
  out << "# sar_nerf_train " << kVersion
      << ": with --config FILE -o RUN this makes the same run again\n";
  out << "dataset = " << quoted(full_path(o.dataset)) << "\n";
  out << "field = " << quoted(o.field) << "\n";
  if (o.time_s) {
    out << "time = " << quoted(Json(*o.time_s).dump() + "s") << "\n";
  } else {
    out << "steps = " << o.steps << "\n";
  }
  out << "seed = " << o.seed << "\n";
  if (o.heights.ground_m) out << "ground-height = " << quoted(Json(*o.heights.ground_m).dump()) << "\n";
  if (o.heights.above_ground_m) out << "scene-height = " << quoted(Json(*o.heights.above_ground_m).dump()) << "\n";
  if (!o.resolution.automatic) {
    const auto& r = o.resolution.resolution;
    out << "resolution = " << quoted(r ? Json(r->azimuth_m).dump() + "," + Json(r->range_m).dump() : "none") << "\n";
    if (r) out << "window = " << quoted(text_of(r->window)) << "\n";
  }
  out << "holdout = " << quoted(o.holdout_text) << "\n";
  if (o.patience > 0.0) out << "patience = " << quoted(Json(o.patience).dump()) << "\n";
  if (!o.against.empty()) out << "against = " << quoted(full_path(o.against)) << "\n";
  if (!o.lpips.empty()) out << "lpips = " << quoted(full_path(o.lpips)) << "\n";
  if (o.despeckle_deg > 0.0) out << "despeckle = " << quoted(Json(o.despeckle_deg).dump()) << "\n";
  out << "option = [";
  bool first = true;
  const Json options = Json::parse(options_json(training));
  for (const auto& [name, value] : options.items()) {
    if (name == "field" || name == "seed") continue;
    out << (first ? "\n" : ",\n") << "  "
        << quoted(name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
    first = false;
  }
  out << "\n]\n";
  return out.str();
}

std::string config_difference(const std::filesystem::path& found, const std::string& wanted,
                              bool with_length) {
  const auto there = settings(read_whole_file(found), found.string());
  const auto now = settings(wanted, "the options");
  std::string text;
  const auto add = [&](const std::string& name, const std::string& a, const std::string& b) {
    if (!with_length && (name == "steps" || name == "time")) return;
    text += (text.empty() ? "" : "; ") + name + ": " + a + " there, " + b + " now";
  };
  for (const auto& [name, value] : now) {
    const auto match = there.find(name);
    if (match == there.end()) {
      add(name, "nothing", value);
    } else if (match->second != value) {
      add(name, match->second, value);
    }
  }
  for (const auto& [name, value] : there) {
    if (!now.contains(name)) add(name, value, "nothing");
  }
  return text;
}

std::optional<std::tuple<double, double, double>> smoothness_in(const std::filesystem::path& found) {
  const auto there = settings(read_whole_file(found), found.string());
  double weights[3];
  double* next = weights;
  for (const char* name : {"option smooth_density", "option smooth_source", "option smooth_angular"}) {
    const auto match = there.find(name);
    if (match == there.end()) return {};
    const Json value = Json::parse(match->second, nullptr, false);
    if (!value.is_number()) return {};
    *next++ = value.get<double>();
  }
  return std::tuple(weights[0], weights[1], weights[2]);
}

}  // namespace sarnerf::app
