// SPDX-License-Identifier: Apache-2.0
#include "recipe.h"

#include <nlohmann/json.hpp>
#include <vector>

#include "formation.h"
#include "layer_files.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/input_text.h"
#include "sarnerf/core/sha256.h"
#include "version.h"

namespace sarnerf::app {
namespace {

constexpr const char* kFormat = "sarnerf-recipe";
constexpr int kFormatVersion = 1;
constexpr std::size_t kMaxDifferences = 3;

template <class Value>
Json or_auto(const std::optional<Value>& value) {
  return value ? Json(*value) : Json("auto");
}

Json count_or_auto(int count) { return count > 0 ? Json(count) : Json("auto"); }

/// Only the name: the folder in which a file lies changes nothing about the image.
Json fingerprint(const std::filesystem::path& path) {
  return {{"file", path.filename().string()}, {"sha256", sha256_of_file(path)}};
}

Json scene_request(const Options& o) {
  Json j = fingerprint(o.scene);
  j["units_m"] = o.units_m;
  j["scale"] = o.scale;
  j["up"] = o.up == UpAxis::z ? "z" : "y";
  if (o.volume()) j["extinction_per_density"] = o.extinction_per_density;
  if (!o.materials.empty()) j["materials"] = fingerprint(o.materials);
  if (o.ground) j["ground"] = *o.ground;
  j["ground_height_m"] = or_auto(o.ground_height_m);
  return j;
}

Json views_request(const Options& o) {
  Json j;
  j["incidence_deg"] = o.incidence_deg;
  j["depression_deg"] = Json::array();
  for (const double angle : o.incidence_deg) j["depression_deg"].push_back(90.0 - angle);
  j["azimuth_deg"] = o.azimuth_deg;
  if (o.slant_range_m) {
    j["slant_range_m"] = *o.slant_range_m;
  } else {
    j["altitude_m"] = o.altitude_m;
  }
  j["look"] = o.look == Look::left ? "left" : "right";
  j["aim_m"] = o.aim_m ? Json{o.aim_m->x, o.aim_m->y, o.aim_m->z} : Json("auto");
  return j;
}

/// The same with what is not UTF-8 replaced, as it comes back from a file: names of files may be any bytes.
Json valid_text(const Json& json) {
  return Json::parse(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

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

Json request_of(const Options& o) {
  Json j;
  j["scene"] = scene_request(o);
  j["views"] = views_request(o);
  j["image"] = {{"size", o.size ? Json{o.size->first, o.size->second} : Json("auto")},
                {"spacing_m", {o.spacing_m.first, o.spacing_m.second}},
                {"calibration", name(o.calibration)},
                {"quantity", name(o.quantity)}};
  if (o.formation.any()) j["formation"] = formation_request(o.formation);
  if (!o.layers.empty()) j["layers"] = layers_request(o.layers);
  j["computation"] = {{"engine", name(o.engine)},
                      {"voxel_size_m", or_auto(o.voxel_size_m)},
                      {"elevations", count_or_auto(o.sampling.n_elevation)},
                      {"sub_rows", count_or_auto(o.sampling.n_sub_rows)},
                      {"integrator", name(o.sampling.integrator)}};
  if (o.tolerance) j["computation"]["error"] = *o.tolerance;
  return valid_text(j);
}

Json make_recipe(const Json& request, const Json& resolved) {
  return valid_text({{"format", kFormat},
                     {"version", kFormatVersion},
                     {"program", "sar_render " + std::string(kVersion)},
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
