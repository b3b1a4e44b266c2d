// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "readers/readers.h"
#include "readers/scene_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

namespace {

Material opaque(const char* name, double gamma0, double exponent) {
  Material material;
  material.name = name;
  material.gamma0 = gamma0;
  material.exponent = exponent;
  return material;
}

Material translucent(const char* name, double extinction_per_m, double scattering_per_m) {
  Material material;
  material.name = name;
  material.opaque = false;
  material.extinction_per_m = material.extinction_back_per_m = extinction_per_m;
  material.scattering_per_m = scattering_per_m;
  return material;
}

}  // namespace

const std::vector<Material>& builtin_materials() {
  // Round nominal values at X band. Each line is explained, with its source, in docs/guide/materials.md.
  static const std::vector<Material> materials = {
      opaque("default", 1.0, 1.0),     opaque("asphalt", 0.04, 2.0),
      opaque("brick", 0.3, 1.5),       opaque("concrete", 0.2, 1.5),
      opaque("glass", 0.1, 6.0),       opaque("grass", 0.15, 0.5),
      opaque("gravel", 0.1, 1.0),      opaque("metal", 2.0, 3.0),
      opaque("roof", 0.2, 1.0),        opaque("snow", 0.12, 0.5),
      opaque("soil", 0.15, 1.0),       opaque("water", 0.02, 6.0),
      opaque("wood", 0.15, 1.0),       translucent("canopy", 0.2, 0.05),
      translucent("hedge", 0.5, 0.12),
  };
  return materials;
}

namespace {

/// Smallest period of a texture: finer than any real surface; smaller squares would only show their mean.
constexpr double kFinestPeriod_m = 1e-9;

/// Largest extinction and scattering (1/m): above those of any real material. Sums over overlapping solids
/// stay within single precision's 3e38.
constexpr double kMost_per_m = 1e30;

Texture parse_texture(const SceneJson& json) {
  json.only_keys({"kind", "period_m", "contrast", "origin_m"});
  Texture texture;
  const SceneJson kind = json.at("kind");
  if (kind.text() == "none") {
    if (json.has("period_m") || json.has("contrast") || json.has("origin_m")) {
      json.fail("the kind \"none\" takes no other keys; remove them, or choose \"checker\"");
    }
    return texture;
  }
  if (kind.text() != "checker") kind.expected("\"none\" or \"checker\"");
  texture.kind = Texture::Kind::checker;
  texture.period_m = json.at("period_m").number_at_least(kFinestPeriod_m);
  const SceneJson contrast = json.at("contrast");
  texture.contrast = contrast.number_at_least(0.0);
  if (texture.contrast > 1.0) contrast.expected("a number between 0 and 1");
  if (const auto origin = json.find("origin_m")) texture.origin_m = origin->vector_within(kFarthest_m);
  return texture;
}

Material parse_material(const std::string& name, const SceneJson& json) {
  json.only_keys({"opaque", "gamma0", "exponent", "texture", "extinction_per_m",
                  "extinction_back_per_m", "scattering_per_m"});
  Material material;
  material.name = name;
  const bool has_volume = json.has("extinction_per_m") || json.has("extinction_back_per_m") ||
                          json.has("scattering_per_m");
  const auto opaque = json.find("opaque");
  material.opaque = opaque ? opaque->boolean() : !has_volume;

  if (material.opaque) {
    if (has_volume) {
      json.fail(
          "an opaque material takes gamma0, exponent and texture, not extinction or scattering; "
          "for a translucent one write \"opaque\": false and only the latter");
    }
    if (const auto gamma0 = json.find("gamma0")) material.gamma0 = gamma0->number_at_least(0.0);
    if (const auto p = json.find("exponent")) material.exponent = p->number_at_least(0.0);
    if (const auto texture = json.find("texture")) material.texture = parse_texture(*texture);
    return material;
  }

  for (const char* key : {"gamma0", "exponent", "texture"}) {
    if (json.has(key)) {
      json.fail(
          std::string("a translucent material takes extinction_per_m and scattering_per_m, not ") +
          key + "; remove it, or the extinction and scattering for an opaque material");
    }
  }
  material.extinction_per_m = json.at("extinction_per_m").number_between(0.0, kMost_per_m);
  material.extinction_back_per_m = material.extinction_per_m;
  if (const auto back = json.find("extinction_back_per_m")) {
    material.extinction_back_per_m = back->number_between(0.0, kMost_per_m);
  }
  if (const auto p = json.find("scattering_per_m")) {
    material.scattering_per_m = p->number_between(0.0, kMost_per_m);
  }
  return material;
}

}  // namespace

std::vector<Material> parse_materials(const SceneJson& materials) {
  std::vector<Material> parsed;
  for (const auto& [name, json] : materials.members()) {
    if (name.empty()) materials.fail("a material needs a name, found \"\"");
    parsed.push_back(parse_material(name, json));
  }
  return parsed;
}

double Texture::factor(const glm::dvec3& object_m) const {
  if (kind == Kind::none) return 1.0;
  const glm::dvec3 square = glm::floor((object_m - effective_origin_m()) / period_m);
  const double sum = square.x + square.y + square.z;
  return std::abs(std::remainder(sum, 2.0)) < 0.5 ? 1.0 + contrast : 1.0 - contrast;
}

MaterialLibrary::MaterialLibrary() : materials_(builtin_materials()) {}

std::vector<std::string> MaterialLibrary::add_file(const std::filesystem::path& path) {
  return add_text(read_file(path, MemoryBudget{}), path.string());
}

std::vector<std::string> MaterialLibrary::add_text(std::string_view text, const std::string& name) {
  const SceneDocument file_text(text, name);
  const SceneJson& document = file_text.root();
  document.only_keys({"format", "version", "materials"});
  document.require_format("sarnerf-materials", 1);
  std::vector<std::string> names;
  for (Material& material : parse_materials(document.at("materials"))) {
    names.push_back(material.name);
    add(std::move(material));
  }
  return names;
}

void MaterialLibrary::add_json(std::string_view json_text, const std::string& where) {
  const SceneDocument document(json_text, where);
  for (Material& material : parse_materials(document.root())) add(std::move(material));
}

void MaterialLibrary::add(Material material) {
  const auto same = std::find_if(materials_.begin(), materials_.end(),
                                 [&](const Material& m) { return m.name == material.name; });
  if (same == materials_.end()) {
    materials_.push_back(std::move(material));
  } else {
    *same = std::move(material);
  }
}

const Material* MaterialLibrary::find(std::string_view name) const {
  const auto found = std::find_if(materials_.begin(), materials_.end(),
                                  [&](const Material& m) { return m.name == name; });
  return found == materials_.end() ? nullptr : &*found;
}

const Material& MaterialLibrary::require(std::string_view name, const std::string& where) const {
  if (const Material* found = find(name)) return *found;
  const std::vector<std::string> known = names();
  const std::string close = closest_name(name, known);
  throw InputError(where + ": unknown material " + in_quotes(name) +
                   (close.empty() ? "" : " (" + close + "?)") + "; known are: " + listed(known));
}

const Material& MaterialLibrary::require_ground(const std::string& name) const {
  try {
    const Material& material = require(name, "--ground");
    if (!material.opaque)
      throw UsageError("--ground: the material " + in_quotes(name) + " is translucent; the ground needs an opaque one");
    return material;
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

std::vector<std::string> MaterialLibrary::names() const {
  std::vector<std::string> names;
  for (const Material& material : materials_) names.push_back(material.name);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace sarnerf
