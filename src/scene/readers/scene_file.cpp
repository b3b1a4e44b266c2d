// SPDX-License-Identifier: Apache-2.0
#include "readers/scene_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <glm/gtc/matrix_transform.hpp>

#include "readers/readers.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

namespace {

constexpr JsonRules kRules{
    .not_json = "expected JSON, found a ",
    .object = "an object in braces",
    .array = "an array in brackets",
    .text = "a text in quotes",
};

}  // namespace

// A name that contains ": " is a position inside a document already; positions of its values continue it.
SceneDocument::SceneDocument(std::string_view text, const std::string& name)
    : value_(parse_json<nlohmann::json>(text, name, kRules)),
      root_(value_, name, kRules, name.find(": ") != std::string::npos) {}

namespace {

UpAxis parse_up(const SceneJson& json) {
  const std::string up = json.text();
  if (up == "y") return UpAxis::y;
  if (up == "z") return UpAxis::z;
  json.expected("\"y\" or \"z\"");
}

double parse_units(const SceneJson& json) {
  if (!json.is_text()) return json.number_above(0.0);
  if (const auto metres = metres_of_unit(json.text())) return *metres;
  json.expected(std::string(kUnitsOfLength) + ", or metres per unit as a number");
}

/// glm::rotate computes cos 90° as 6e-17; right angles are common, so they are made exact.
glm::dmat4 rotation(double angle_deg, const glm::dvec3& axis) {
  glm::dmat4 matrix = glm::rotate(glm::dmat4(1.0), rad_from_deg(angle_deg), axis);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      const double nearest = std::round(matrix[column][row]);
      if (std::abs(matrix[column][row] - nearest) < 1e-15) matrix[column][row] = nearest;
    }
  }
  return matrix;
}

glm::dmat4 parse_rotation(const SceneJson& json) {
  if (json.is_array()) {
    const glm::dvec3 angles_deg = json.vector();
    return rotation(angles_deg.z, {0, 0, 1}) * rotation(angles_deg.y, {0, 1, 0}) *
           rotation(angles_deg.x, {1, 0, 0});
  }
  json.only_keys({"axis", "angle"});
  const SceneJson axis = json.at("axis");
  const glm::dvec3 direction = axis.vector();
  const double length = glm::length(direction);
  if (!(length > 0.0) || !std::isfinite(length)) axis.expected("an axis with a direction");
  return rotation(json.at("angle").number(), direction / length);
}

std::filesystem::path parse_path(const SceneJson& json, const std::filesystem::path& folder) {
  const std::string name = json.text();
  if (name.empty() || has_control_characters(name)) json.expected("the name of a file");
  return folder / name;
}

MeshEntry parse_mesh(const SceneJson& json, const std::filesystem::path& folder, UpAxis scene_up) {
  json.only_keys(
      {"file", "up", "units", "scale", "rotate_deg", "translate_m", "material", "materials"});
  MeshEntry entry;
  entry.place = json.place();
  const SceneJson file = json.at("file");
  entry.file = parse_path(file, folder);
  if (!is_mesh_file(entry.file)) file.expected("a file ending in .obj, .ply, .stl or .off");
  const auto up = json.find("up");
  entry.up = up ? parse_up(*up) : scene_up;
  if (const auto units = json.find("units")) entry.metres_per_unit *= parse_units(*units);
  if (const auto scale = json.find("scale")) entry.metres_per_unit *= scale->number_above(0.0);

  glm::dmat4 placement(1.0);
  if (const auto move = json.find("translate_m"))
    placement = glm::translate(placement, move->vector_within(kFarthest_m));
  if (const auto turn = json.find("rotate_deg")) placement = placement * parse_rotation(*turn);
  const glm::dmat4 axes = world_from_axes(scene_up);
  entry.world_from_object = axes * placement * glm::transpose(axes);

  if (const auto material = json.find("material")) entry.material = material->text();
  if (const auto materials = json.find("materials")) {
    for (const auto& [name, target] : materials->members()) entry.materials[name] = target.text();
  }
  return entry;
}

GroundEntry parse_ground(const SceneJson& json) {
  json.only_keys({"material", "height_m"});
  GroundEntry ground{json.at("material").text(), std::nullopt, json.place()};
  if (const auto height = json.find("height_m")) {
    ground.height_m = height->number();
    if (std::abs(*ground.height_m) > kFarthest_m) height->expected("a height within " + number_text(kFarthest_m) + " m");
  }
  return ground;
}

}  // namespace

glm::dmat4 world_from_axes(UpAxis up) {
  if (up == UpAxis::y) return glm::dmat4(1.0);
  // (x, y, z) → (x, z, −y), column by column.
  return glm::dmat4({1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1});
}

SceneFile read_scene_file(const std::filesystem::path& path) {
  return parse_scene_file(read_file(path, MemoryBudget{}), path.string(), path.parent_path());
}

SceneFile parse_scene_file(std::string_view text, const std::string& name,
                           const std::filesystem::path& folder) {
  const SceneDocument file_text(text, name);
  const SceneJson& document = file_text.root();
  document.only_keys(
      {"format", "version", "up", "meshes", "materials_file", "materials", "ground"});
  document.require_format("sarnerf-scene", 1);

  SceneFile scene;
  const auto up = document.find("up");
  const UpAxis scene_up = up ? parse_up(*up) : UpAxis::y;
  for (const SceneJson& mesh : document.at("meshes").elements()) {
    scene.meshes.push_back(parse_mesh(mesh, folder, scene_up));
  }
  if (const auto file = document.find("materials_file")) {
    scene.materials_file = parse_path(*file, folder);
    scene.library.add_file(scene.materials_file);
    scene.materials_source = file->text();
  }
  if (const auto materials = document.find("materials")) {
    for (Material& material : parse_materials(*materials)) scene.library.add(std::move(material));
    scene.materials_source = name;
  }
  if (const auto ground = document.find("ground")) scene.ground = parse_ground(*ground);
  return scene;
}

namespace {

constexpr double kSmallest_m = 0.05;
constexpr double kLargest_m = 200'000.0;
/// Least fraction of the scene's height below the ground that causes a warning: cellars are less.
constexpr double kBuried = 1.0 / 3.0;

/// Relative rounding error of a number in single precision, at most.
constexpr double kHalfRounding = 0x1p-24;
/// Fraction of a mesh's diagonal above which the rounding of its vertices is visible.
constexpr double kVisibleRounding = 1e-5;

std::string rounded_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

void require_reach(const MeshEntry& entry, const TriangleSoup& soup) {
  for (const glm::dvec3& vertex : soup.vertices) {
    const glm::dvec3 size = glm::abs(vertex) * entry.metres_per_unit;
    if (glm::all(glm::lessThan(size, glm::dvec3(kFarthest_m)))) continue;
    throw InputError(entry.file.string() + ": expected coordinates within " +
                     number_text(kFarthest_m) + " m, found a vertex at (" + number_text(vertex.x) +
                     ", " + number_text(vertex.y) + ", " + number_text(vertex.z) +
                     ") in units of " + number_text(entry.metres_per_unit) +
                     " m; correct it, or choose other --units");
  }
}

void warn_about_precision(const MeshEntry& entry, const TriangleSoup& soup, SceneReport& report) {
  if (!soup.single_precision) return;
  Box box;
  double farthest = 0.0;
  for (const glm::dvec3& v : soup.vertices) {
    box.include(v);
    farthest = std::max({farthest, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  }
  const double rounding = kHalfRounding * farthest;
  if (!(rounding > kVisibleRounding * glm::length(box.size()))) return;
  report.warnings.push_back(entry.file.filename().string() + ": its vertices, " +
                            rounded_text(farthest * entry.metres_per_unit) +
                            " m from the origin, are stored in single precision, rounded by up to " +
                            rounded_text(rounding * entry.metres_per_unit) +
                            " m; export them relative to a point nearby, or as text");
}

void warn_about_size(Scene& scene) {
  if (scene.box.empty()) return;
  const double diagonal_m = glm::length(scene.box.size());
  if (diagonal_m < kSmallest_m || diagonal_m > kLargest_m) {
    scene.report.warnings.push_back(std::string("the scene measures ") + rounded_text(diagonal_m) +
                                    " m from corner to corner, which is suspiciously " +
                                    (diagonal_m < kSmallest_m ? "small" : "large") +
                                    "; set its units (--units and --scale, or \"units\" and \"scale\" in a scene file)");
  }
  if (!scene.ground) return;
  const double height_m = scene.box.size().y;
  const double buried = height_m > 0.0 ? (scene.ground->height_m - scene.box.min.y) / height_m : 0.0;
  if (buried >= kBuried && buried < 1.0) {
    scene.report.warnings.push_back(
        "the ground at " + number_text(scene.ground->height_m) + " m hides the lower " +
        std::to_string(static_cast<int>(100.0 * buried)) +
        " % of the scene's height; check --ground-height");
  }
  if (scene.ground->height_m >= scene.box.max.y) {
    scene.report.warnings.push_back("the ground at " + number_text(scene.ground->height_m) +
                                    " m lies above the whole scene, whose top is at " +
                                    number_text(scene.box.max.y) + " m, and hides it");
  }
}

}  // namespace sarnerf
