// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/scene/scene.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace sarnerf {
namespace {

constexpr std::array<std::pair<std::string_view, Component>, 19> kWords{{
    {"ground", Component::ground},
    {"floor", Component::ground},
    {"terrain", Component::ground},
    {"road", Component::ground},
    {"field", Component::ground},
    {"pavement", Component::ground},
    {"street", Component::ground},
    {"grass", Component::ground},
    {"lawn", Component::ground},
    {"soil", Component::ground},
    {"sand", Component::ground},
    {"water", Component::ground},
    {"wall", Component::wall},
    {"walls", Component::wall},
    {"facade", Component::wall},
    {"side", Component::wall},
    {"roof", Component::roof},
    {"roofs", Component::roof},
    {"top", Component::roof},
}};

Component component_from_normal(const Mesh& mesh, std::size_t triangle, bool closed) {
  const glm::uvec3& c = mesh.triangles[triangle];
  const glm::dvec3 area = glm::cross(mesh.vertices_m[c.y] - mesh.vertices_m[c.x],
                                     mesh.vertices_m[c.z] - mesh.vertices_m[c.x]);
  // A thin shell has two sides, one of which faces up.
  const double up = closed ? area.y : std::abs(area.y);
  return up > glm::length(area) * (0.5 * std::numbers::sqrt2) ? Component::roof : Component::wall;
}

}  // namespace

std::string_view name(Component component) {
  switch (component) {
    case Component::ground:
      return "ground";
    case Component::wall:
      return "wall";
    case Component::roof:
      return "roof";
    case Component::other:
      return "other";
    case Component::none:
      break;
  }
  return "none";
}

Component component_from_words(std::string_view words) {
  std::string word;
  for (std::size_t n = 0; n <= words.size(); ++n) {
    const unsigned char c = n < words.size() ? static_cast<unsigned char>(words[n]) : ' ';
    if (std::isalpha(c)) {
      word += static_cast<char>(std::tolower(c));
      continue;
    }
    for (const auto& [known, component] : kWords) {
      if (word == known) return component;
    }
    word.clear();
  }
  return Component::none;
}

std::vector<Component> components_of_triangles(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  std::vector<Component> of_group, of_material;
  for (const std::string& group : scene.groups) of_group.push_back(component_from_words(group));
  for (const Material& material : scene.materials) {
    of_material.push_back(component_from_words(material.name));
  }
  std::vector<Component> components(mesh.triangles.size());
  for (std::size_t t = 0; t < components.size(); ++t) {
    if (!scene.materials[mesh.material[t]].opaque) {
      components[t] = Component::other;
    } else if (of_group[mesh.group[t]] != Component::none) {
      components[t] = of_group[mesh.group[t]];
    } else if (of_material[mesh.material[t]] != Component::none) {
      components[t] = of_material[mesh.material[t]];
    } else {
      components[t] = component_from_normal(mesh, t, scene.pieces[mesh.piece[t]].closed);
    }
  }
  return components;
}

}  // namespace sarnerf
