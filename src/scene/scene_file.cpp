// SPDX-License-Identifier: Apache-2.0
#include "scene_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <utility>

#include "json_view.h"
#include "material_json.h"
#include "readers.h"
#include "sarnerf/core/units.h"
#include "scene_checks.h"
#include "text.h"

namespace sarnerf {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 6> kUnits = {
    {{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"km", 1000.0}, {"in", 0.0254}, {"ft", 0.3048}}};

UpAxis parse_up(const JsonView& json) {
  const std::string up = json.text();
  if (up == "y") return UpAxis::y;
  if (up == "z") return UpAxis::z;
  json.expected("\"y\" or \"z\"");
}

double parse_units(const JsonView& json) {
  if (!json.is_text()) return json.number_above(0.0);
  const std::string name = json.text();
  for (const auto& [unit, metres] : kUnits) {
    if (unit == name) return metres;
  }
  json.expected("m, cm, mm, km, in, ft, or metres per unit as a number");
}

/// glm::rotate takes cos 90° for 6e-17; right angles are common, so they are made exact.
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

glm::dmat4 parse_rotation(const JsonView& json) {
  if (json.is_array()) {
    const glm::dvec3 angles_deg = json.vector();
    return rotation(angles_deg.z, {0, 0, 1}) * rotation(angles_deg.y, {0, 1, 0}) *
           rotation(angles_deg.x, {1, 0, 0});
  }
  json.only_keys({"axis", "angle"});
  const JsonView axis = json.at("axis");
  const glm::dvec3 direction = axis.vector();
  const double length = glm::length(direction);
  if (!(length > 0.0) || !std::isfinite(length)) axis.expected("an axis with a direction");
  return rotation(json.at("angle").number(), direction / length);
}

std::filesystem::path parse_path(const JsonView& json, const std::filesystem::path& folder) {
  const std::string name = json.text();
  if (name.empty() || has_control_characters(name)) json.expected("the name of a file");
  return folder / name;
}

MeshEntry parse_mesh(const JsonView& json, const std::filesystem::path& folder, UpAxis scene_up) {
  json.only_keys(
      {"file", "up", "units", "scale", "rotate_deg", "translate_m", "material", "materials"});
  MeshEntry entry;
  entry.place = json.place();
  const JsonView file = json.at("file");
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

GroundEntry parse_ground(const JsonView& json) {
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
  const nlohmann::json json = parse_json(text, name);
  const JsonView document(json, name);
  document.only_keys(
      {"format", "version", "up", "meshes", "materials_file", "materials", "ground"});
  document.require_format("sarnerf-scene", 1);

  SceneFile scene;
  const auto up = document.find("up");
  const UpAxis scene_up = up ? parse_up(*up) : UpAxis::y;
  for (const JsonView& mesh : document.at("meshes").elements()) {
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

}  // namespace sarnerf
