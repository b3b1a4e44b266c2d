// SPDX-License-Identifier: Apache-2.0
#include "recipe.h"

#include <nlohmann/json.hpp>
#include <vector>

#include "formation.h"
#include "layer_files.h"
#include "sarnerf/core/sha256.h"

namespace sarnerf::app {
namespace {

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

}  // namespace sarnerf::app
