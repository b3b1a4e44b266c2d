// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "material_json.h"
#include "readers.h"
#include "sarnerf/core/closest_name.h"
#include "sarnerf/core/error.h"
#include "sarnerf/scene/material.h"
#include "text.h"

namespace sarnerf {

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
  const nlohmann::json json = parse_json(text, name);
  const JsonView document(json, name);
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
  const nlohmann::json json = parse_json(json_text, where);
  for (Material& material : parse_materials(JsonView(json, where))) add(std::move(material));
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

std::vector<std::string> MaterialLibrary::names() const {
  std::vector<std::string> names;
  for (const Material& material : materials_) names.push_back(material.name);
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace sarnerf
