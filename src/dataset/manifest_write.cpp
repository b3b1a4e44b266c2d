// SPDX-License-Identifier: Apache-2.0
#include "json_reader.h"
#include "manifest_names.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf {
namespace {

Json vector_json(const glm::dvec3& v) { return Json::array({v.x, v.y, v.z}); }

Json view_json(const DatasetView& view) {
  Json j;
  j["image"] = view.image;
  j["azimuth_deg"] = view.azimuth_deg;
  j["incidence_deg"] = view.incidence_deg;
  j["depression_deg"] = view.depression_deg();
  j["slant_range_m"] = view.slant_range_m;
  if (view.altitude_m) j["altitude_m"] = *view.altitude_m;
  j["n_azimuth"] = view.n_azimuth;
  j["n_range"] = view.n_range;
  j["azimuth_spacing_m"] = view.azimuth_spacing_m;
  j["range_spacing_m"] = view.range_spacing_m;
  j["axes"] = Json::array({kAxisNames[static_cast<std::size_t>(view.axes[0])],
                           kAxisNames[static_cast<std::size_t>(view.axes[1])]});
  j["look"] = kLookNames[static_cast<std::size_t>(view.look)];
  if (!view.class_name.empty()) j["class"] = view.class_name;
  if (!view.serial.empty()) j["serial"] = view.serial;
  if (!view.source.empty()) j["source"] = view.source;
  return j;
}

/// The object's text with the views, one a line, in place of its last brace.
std::string with_views(const Json& head, const std::vector<DatasetView>& views) {
  std::string text = head.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  text.erase(text.rfind("\n}"));
  text += ",\n  \"views\": [";
  const char* separator = "\n    ";
  for (const DatasetView& view : views) {
    text += separator + view_text(view);
    separator = ",\n    ";
  }
  return text + "\n  ]\n}\n";
}

}  // namespace

std::string view_text(const DatasetView& view) { return view_json(view).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace); }

std::string manifest_text(const Dataset& dataset) {
  Json head;
  head["format"] = kManifestFormat;
  head["version"] = kManifestVersion;
  head["quantity"] = name(dataset.quantity);
  head["calibration"] = name(dataset.calibration);
  head["scale"] = dataset.scale;
  head["aim_m"] = vector_json(dataset.aim_m);
  head["scene_box_m"] =
      Json::array({vector_json(dataset.scene_box_m.min), vector_json(dataset.scene_box_m.max)});
  if (const auto& r = dataset.resolution)
    head["impulse_response"] = {{"resolution_m", {r->azimuth_m, r->range_m}}, {"window", text_of(r->window)}};
  if (dataset.unfinished()) head["planned_views"] = dataset.n_planned_views;
  if (!dataset.splits.empty()) head["splits"] = dataset.splits;
  std::string text;
  try {
    head["provenance"] = Json::parse(dataset.provenance_json);
    text = with_views(head, dataset.views);
  } catch (const nlohmann::json::exception& e) {
    throw UsageError(std::string("a dataset holds a text that JSON cannot: ") + e.what());
  }
  try {
    (void)parse_manifest(text, std::string(kManifestName));
  } catch (const InputError& e) {
    throw UsageError(std::string("a dataset to be written is not valid: ") + e.what());
  }
  return text;
}

}  // namespace sarnerf
