// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/manifest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "core/json_view.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

bool same_angles(const DatasetView& a, const DatasetView& b) {
  constexpr double kSame_deg = 1e-6;
  return std::abs(std::remainder(a.azimuth_deg - b.azimuth_deg, 360.0)) < kSame_deg &&
         std::abs(a.incidence_deg - b.incidence_deg) < kSame_deg && a.look == b.look;
}

Acquisition acquisition_of(const DatasetView& view, const glm::dvec3& aim_m) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(view.azimuth_deg);
  a.incidence_rad = rad_from_deg(view.incidence_deg);
  a.slant_range_m = view.slant_range_m;
  a.aim_m = aim_m;
  a.look = view.look;
  a.n_azimuth = view.n_azimuth;
  a.n_range = view.n_range;
  a.azimuth_spacing_m = view.azimuth_spacing_m;
  a.range_spacing_m = view.range_spacing_m;
  return a;
}

std::string unfinished_text(const Dataset& dataset) {
  if (!dataset.unfinished()) return "";
  return std::to_string(dataset.views.size()) + " of " + std::to_string(dataset.n_planned_views) +
         " views: the program that makes them was interrupted; the same command makes the rest";
}

Box scene_box_of_swath(const glm::dvec3& aim_m, std::span<const DatasetView> views) {
  if (views.empty()) throw UsageError("a dataset needs at least one view");
  double half_m = 0.0, height_m = 0.0;
  for (const DatasetView& view : views) {
    const double incidence_rad = rad_from_deg(view.incidence_deg);
    const double swath_m = view.n_range * view.range_spacing_m;
    const double ground_m = swath_m / std::sin(incidence_rad);
    half_m = std::max(half_m, 0.5 * std::hypot(view.n_azimuth * view.azimuth_spacing_m, ground_m));
    height_m = std::max(height_m, 0.5 * swath_m / std::cos(incidence_rad));
  }
  return {aim_m - glm::dvec3(half_m, 0.0, half_m), aim_m + glm::dvec3(half_m, height_m, half_m)};
}

namespace {

constexpr std::string_view kManifestFormat = "sarnerf-dataset";
constexpr int kManifestVersion = 1;

/// In the order of enum class Axis.
constexpr std::array<std::string_view, 4> kAxisNames{"+i", "-i", "+j", "-j"};

/// In the order of enum class Look.
constexpr std::array<std::string_view, 2> kLookNames{"right", "left"};

/// Keeps the order of keys, so that a manifest that is read and written again stays the same text.
using Json = nlohmann::ordered_json;

constexpr JsonRules kRules{
    .not_json = "not valid JSON: ",
    .object = "an object",
    .array = "an array",
    .text = "a text",
    .most_keys = 4096,
};

/// A JSON value that records which keys of an object were requested. finish() refuses other keys: most are misspelt.
class JsonReader : public JsonView<Json> {
 public:
  JsonReader(const Json& document, const std::string& where)
      : JsonView<Json>(document, where, kRules, !where.ends_with(".json")) {}

  bool has(const std::string& key) {
    asked_.insert(key);
    return find(key).has_value();
  }
  JsonReader at(const std::string& key) {
    if (!has(key)) fail("the key \"" + key + "\" is missing");
    return JsonReader(JsonView<Json>::at(key));
  }
  JsonReader at(std::size_t index) const { return JsonReader(JsonView<Json>::at(index)); }

  double positive_number() const {
    const double value = number();
    if (!(value > 0.0)) expected("a number above zero");
    return value;
  }

  int positive_integer() const {
    if (!json().is_number_integer()) expected("a whole number");
    const double number = json().get<double>();
    if (!(number >= 1.0 && number <= std::numeric_limits<int>::max())) expected("a whole number above zero");
    return json().get<int>();
  }

  std::optional<double> optional_number(const std::string& key) {
    return has(key) ? std::optional(at(key).number()) : std::nullopt;
  }
  std::string optional_text(const std::string& key) { return has(key) ? at(key).text() : std::string(); }

  /// Refuses the first key that was not requested.
  void finish() const {
    for (const auto& [key, value] : json().items()) {
      if (!asked_.contains(key)) fail("the key \"" + in_one_line(key, 60) + "\" is unknown; misspelt?");
    }
  }

 private:
  explicit JsonReader(JsonView<Json> value) : JsonView<Json>(std::move(value)) {}

  std::set<std::string> asked_;
};

/// Heights are often published rounded. Larger deviations mean different geometries.
constexpr double kAltitudeTolerance = 0.01;

template <std::size_t N>
std::size_t index_of_name(const JsonReader& reader, const std::array<std::string_view, N>& names) {
  const std::string text = reader.text();
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) {
    std::string known;
    for (const std::string_view n : names) known += (known.empty() ? "" : ", ") + std::string(n);
    reader.fail("expected one of " + known + ", found \"" + in_one_line(text, 60) + "\"");
  }
  return static_cast<std::size_t>(found - names.begin());
}

/// Calls one of the library's *_from_name functions and adds the JSON location to its error.
template <class FromName>
auto enumerator(const JsonReader& reader, FromName from_name) {
  try {
    return from_name(reader.text());
  } catch (const UsageError& e) {
    reader.fail(e.what());
  }
}

glm::dvec3 read_vector(const JsonReader& reader) {
  if (reader.array_size() != 3) reader.fail("expected [x, y, z]");
  return {reader.at(0).number(), reader.at(1).number(), reader.at(2).number()};
}

Box read_box(const JsonReader& reader) {
  if (reader.array_size() != 2) reader.fail("expected [[min x, y, z], [max x, y, z]]");
  const Box box{read_vector(reader.at(0)), read_vector(reader.at(1))};
  if (box.empty()) reader.fail("expected min <= max on every axis");
  return box;
}

std::string read_image_path(const JsonReader& reader) {
  const std::string text = reader.text();
  const std::filesystem::path path = text;
  const bool leaves = std::any_of(path.begin(), path.end(), [](const auto& p) { return p == ".."; });
  if (text.empty() || has_control_characters(text) || path.is_absolute() || leaves) {
    reader.fail("expected a path inside the dataset's folder, found \"" + in_one_line(text, 60) + "\"");
  }
  return text;
}

double read_incidence_deg(JsonReader& view) {
  const auto incidence = view.optional_number("incidence_deg");
  const auto depression = view.optional_number("depression_deg");
  if (!incidence && !depression) {
    view.fail("\"incidence_deg\" (from the vertical) or \"depression_deg\" (from the horizontal) is "
              "needed, neither is there");
  }
  char text[200];
  if (incidence && depression && std::abs(*incidence + *depression - 90.0) > kSameAngle_deg) {
    std::snprintf(text, sizeof text,
                  "incidence_deg %.10g and depression_deg %.10g contradict each other: they must add "
                  "up to 90; remove the wrong one",
                  *incidence, *depression);
    view.fail(text);
  }
  const double result = incidence ? *incidence : 90.0 - *depression;
  if (!(result > 0.0 && result < 90.0)) {
    std::snprintf(text, sizeof text,
                  "incidence must lie between 0 and 90 degrees, both excluded; it is %.10g", result);
    view.fail(text);
  }
  return result;
}

std::optional<double> read_altitude_m(JsonReader& view, double slant_range_m, double incidence_deg) {
  const auto altitude = view.optional_number("altitude_m");
  if (!altitude) return altitude;
  const double implied_m = slant_range_m * std::cos(rad_from_deg(incidence_deg));
  if (std::abs(*altitude - implied_m) > kAltitudeTolerance * implied_m) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "altitude_m %.10g contradicts slant_range_m and incidence, which put the radar "
                  "%.10g m above the aim point",
                  *altitude, implied_m);
    view.fail(text);
  }
  return altitude;
}

std::array<Axis, 2> read_axes(const JsonReader& reader) {
  if (reader.array_size() != 2) reader.fail("expected [row, column], such as [\"+i\", \"+j\"]");
  const std::size_t row = index_of_name(reader.at(0), kAxisNames);
  const std::size_t column = index_of_name(reader.at(1), kAxisNames);
  if (row / 2 == column / 2) reader.fail("expected one axis along i and one along j");
  return {static_cast<Axis>(row), static_cast<Axis>(column)};
}

DatasetView read_view(JsonReader reader, const glm::dvec3& aim_m) {
  DatasetView view;
  view.image = read_image_path(reader.at("image"));
  view.azimuth_deg = reader.at("azimuth_deg").number();
  view.incidence_deg = read_incidence_deg(reader);
  view.slant_range_m = reader.at("slant_range_m").positive_number();
  view.altitude_m = read_altitude_m(reader, view.slant_range_m, view.incidence_deg);
  view.n_azimuth = reader.at("n_azimuth").positive_integer();
  view.n_range = reader.at("n_range").positive_integer();
  view.azimuth_spacing_m = reader.at("azimuth_spacing_m").positive_number();
  view.range_spacing_m = reader.at("range_spacing_m").positive_number();
  view.axes = read_axes(reader.at("axes"));
  view.look = static_cast<Look>(index_of_name(reader.at("look"), kLookNames));
  view.class_name = reader.optional_text("class");
  view.serial = reader.optional_text("serial");
  view.source = reader.optional_text("source");
  reader.finish();
  try {
    validate(acquisition_of(view, aim_m));
  } catch (const GeometryError& e) {
    reader.fail(e.what());
  }
  return view;
}

std::vector<DatasetView> read_views(const JsonReader& reader, const glm::dvec3& aim_m) {
  std::vector<DatasetView> views;
  std::set<std::string> images;
  for (std::size_t n = 0; n < reader.array_size(); ++n) {
    views.push_back(read_view(reader.at(n), aim_m));
    if (!images.insert(views.back().image).second) {
      reader.at(n).fail("the image \"" + in_one_line(views.back().image, 60) + "\" is listed twice");
    }
  }
  if (views.empty()) reader.fail("expected at least one view");
  return views;
}

std::size_t read_planned_views(const JsonReader& reader, std::size_t n_views) {
  const auto n_planned = static_cast<std::size_t>(reader.positive_integer());
  if (n_planned <= n_views) {
    reader.fail("expected more than the " + std::to_string(n_views) + " views that are there, found " + std::to_string(n_planned));
  }
  return n_planned;
}

Resolution read_resolution(JsonReader reader) {
  Resolution resolution;
  const JsonReader widths = reader.at("resolution_m");
  if (widths.array_size() != 2) widths.fail("expected two widths in metres, azimuth and range");
  resolution.azimuth_m = widths.at(0).positive_number();
  resolution.range_m = widths.at(1).positive_number();
  const JsonReader window = reader.at("window");
  try {
    resolution.window = window_from_text(window.text());
  } catch (const UsageError& e) {
    window.fail(e.what());
  }
  reader.finish();
  return resolution;
}

std::map<std::string, std::vector<std::string>> read_splits(JsonReader reader,
                                                            const std::vector<DatasetView>& views) {
  std::set<std::string> free;
  for (const DatasetView& view : views) free.insert(view.image);
  std::map<std::string, std::vector<std::string>> splits;
  if (!reader.json().is_object()) reader.fail("expected an object of lists of images");
  for (const auto& [split, images] : reader.json().items()) {
    const JsonReader list = reader.at(split);
    for (std::size_t n = 0; n < list.array_size(); ++n) {
      const std::string image = list.at(n).text();
      if (free.erase(image) == 0) {
        list.at(n).fail("\"" + in_one_line(image, 60) + "\" is not an image of this dataset, or is already in a split");
      }
      splits[split].push_back(image);
    }
  }
  return splits;
}

/// Why a folder has no manifest. Programs that make datasets write the recipe first and the manifest last.
std::string why_missing(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder / "recipe.json", ignored) || !std::filesystem::is_directory(folder / "images", ignored))
    return "the manifest cannot be opened; expected a dataset's folder";
  const auto n_images = std::ranges::count_if(std::filesystem::directory_iterator(folder / "images", ignored),
                                              [](const auto& entry) { return entry.path().extension() == ".tif"; });
  return "the program that makes this dataset was stopped before it wrote its manifest, or is still at work (" +
         std::to_string(n_images) + (n_images == 1 ? " image is" : " images are") +
         " there); repeat its command, which keeps what is whole and makes the rest";
}

}  // namespace

Dataset parse_manifest(std::string_view text, const std::string& where) {
  const Json document = parse_json<Json>(text, where, kRules);
  JsonReader reader(document, where);
  if (const std::string format = reader.at("format").text(); format != kManifestFormat) {
    reader.fail("expected format \"" + std::string(kManifestFormat) + "\", found \"" + in_one_line(format, 60) + "\"");
  }
  if (const int version = reader.at("version").positive_integer(); version != kManifestVersion) {
    reader.fail("this program reads version " + std::to_string(kManifestVersion) + ", found version " +
                std::to_string(version) + "; use a newer program");
  }
  Dataset dataset;
  dataset.quantity = enumerator(reader.at("quantity"), quantity_from_name);
  dataset.calibration = enumerator(reader.at("calibration"), calibration_from_name);
  dataset.scale = reader.at("scale").positive_number();
  dataset.aim_m = read_vector(reader.at("aim_m"));
  dataset.scene_box_m = read_box(reader.at("scene_box_m"));
  if (reader.has("impulse_response")) dataset.resolution = read_resolution(reader.at("impulse_response"));
  dataset.views = read_views(reader.at("views"), dataset.aim_m);
  if (reader.has("planned_views")) dataset.n_planned_views = read_planned_views(reader.at("planned_views"), dataset.views.size());
  if (reader.has("splits")) dataset.splits = read_splits(reader.at("splits"), dataset.views);
  const JsonReader provenance = reader.at("provenance");
  if (!provenance.json().is_object()) provenance.fail("expected an object");
  dataset.provenance_json = provenance.json().dump();
  // Datasets of older programs lack the key: their poses are exact if the provenance names sar_render.
  dataset.exact_poses = reader.has("exact_poses") ? reader.at("exact_poses").boolean()
                                                  : dataset.provenance_json.find("sar_render") != std::string::npos;
  reader.finish();
  return dataset;
}

Dataset read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / kManifestName;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) throw InputError(path.string() + ": " + why_missing(folder));
  return parse_manifest(read_whole_file(path), path.string());
}

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

/// The object's text, with the views appended as its last key, one view a line.
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
  head["exact_poses"] = dataset.exact_poses;
  if (const auto& r = dataset.resolution)
    head["impulse_response"] = {{"resolution_m", {r->azimuth_m, r->range_m}}, {"window", text_of(r->window)}};
  if (dataset.unfinished()) head["planned_views"] = dataset.n_planned_views;
  if (!dataset.splits.empty()) head["splits"] = dataset.splits;
  std::string text;
  try {
    head["provenance"] = Json::parse(dataset.provenance_json);
    text = with_views(head, dataset.views);
  } catch (const nlohmann::json::exception& e) {
    throw UsageError(std::string("a dataset has a text that JSON cannot represent: ") + e.what());
  }
  try {
    (void)parse_manifest(text, std::string(kManifestName));
  } catch (const InputError& e) {
    throw UsageError(std::string("a dataset to be written is not valid: ") + e.what());
  }
  return text;
}

std::string dataset_fingerprint(const std::filesystem::path& folder, const Dataset& dataset,
                                const Monitor& monitor) {
  std::vector<std::string> names{std::string(kManifestName)};
  for (const DatasetView& view : dataset.views) names.push_back(view.image);
  std::vector<std::string> digests(names.size());
  parallel_for(names.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      digests[n] = sha256_of_file(folder / names[n]);
    }
  });
  Sha256 all;
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::string line = digests[n] + "  " + names[n] + "\n";
    all.update(std::as_bytes(std::span(line)));
  }
  return all.hex_digest();
}

}  // namespace sarnerf
