// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/scene/scene.h"

#include <cmath>

#include "catch.h"
#include "sarnerf/core/units.h"
#include "solids.h"

using namespace sarnerf;

namespace {

/// A scene of single triangles, each a piece, group and material of its own.
class Triangles {
 public:
  /// `tilt_deg`: of the front's normal from straight up, about X.
  Triangles& add(double tilt_deg, bool closed, const std::string& group = "", const std::string& material = "paint",
                 bool opaque = true) {
    const double t = rad_from_deg(tilt_deg);
    const auto first = static_cast<std::uint32_t>(scene.mesh.vertices_m.size());
    const glm::dvec3 u(0, -std::sin(t), std::cos(t)), v(1, 0, 0);  // u × v = (0, cos t, sin t)
    for (const glm::dvec3& p : {glm::dvec3(5, 6, 7), glm::dvec3(5, 6, 7) + u, glm::dvec3(5, 6, 7) + v}) {
      scene.mesh.vertices_m.push_back(p);
    }
    const auto n = static_cast<std::uint32_t>(scene.mesh.triangles.size());
    scene.mesh.triangles.emplace_back(first, first + 1, first + 2);
    scene.mesh.piece.push_back(n);
    scene.mesh.group.push_back(n);
    scene.mesh.material.push_back(n);
    scene.pieces.push_back({closed, 0});
    scene.groups.push_back(group);
    scene.materials.emplace_back();
    scene.materials.back().name = material;
    scene.materials.back().opaque = opaque;
    return *this;
  }
  std::vector<Component> components() const { return components_of_triangles(scene); }
  Component only() const { return components().at(0); }

  Scene scene;
};

}  // namespace

TEST_CASE("Words decide as whole words, in any case, the first one that speaks of something") {
  CHECK(component_from_words("Roof") == Component::roof);
  CHECK(component_from_words("ROOF_02") == Component::roof);
  CHECK(component_from_words("building3-wall.north") == Component::wall);
  CHECK(component_from_words("wall") == Component::wall);
  CHECK(component_from_words("WALLS") == Component::wall);
  CHECK(component_from_words("the facade") == Component::wall);
  CHECK(component_from_words("side") == Component::wall);
  CHECK(component_from_words("top") == Component::roof);
  for (const char* word : {"ground", "floor", "terrain", "road", "field", "pavement", "street", "grass", "lawn", "soil",
                           "sand", "water"}) {
    INFO(word);
    CHECK(component_from_words(word) == Component::ground);
  }
  CHECK(component_from_words("roof wall") == Component::roof);
  CHECK(component_from_words("wall roof") == Component::wall);
  for (const char* words : {"", " ", "rooftop", "sandstone", "stop", "inside", "metal", "42", "Mauer_ö"}) {
    INFO(words);
    CHECK(component_from_words(words) == Component::none);
  }
}

TEST_CASE("Group before material, material before normal") {
  CHECK(Triangles().add(0, true, "wall", "grass").only() == Component::wall);
  CHECK(Triangles().add(0, true, "part", "grass").only() == Component::ground);
  CHECK(Triangles().add(0, true, "part", "paint").only() == Component::roof);
  CHECK(Triangles().add(90, true, "roof", "wall").only() == Component::roof);
}

TEST_CASE("Without words, a face that looks up by more than 45 degrees is roof, any other one wall") {
  CHECK(Triangles().add(0, true).only() == Component::roof);
  CHECK(Triangles().add(44.9, true).only() == Component::roof);
  CHECK(Triangles().add(-44.9, true).only() == Component::roof);
  CHECK(Triangles().add(45.1, true).only() == Component::wall);
  CHECK(Triangles().add(90, true).only() == Component::wall);
  CHECK(Triangles().add(180, true).only() == Component::wall);
  // A thin shell has two sides, one of which looks up.
  CHECK(Triangles().add(180, false).only() == Component::roof);
  CHECK(Triangles().add(135.1, false).only() == Component::roof);
  CHECK(Triangles().add(134.9, false).only() == Component::wall);
}

TEST_CASE("Translucent matter is other, whatever it is called") {
  CHECK(Triangles().add(0, true, "roof", "wall", false).only() == Component::other);
}

TEST_CASE("Each triangle by itself, names of components") {
  const auto components = Triangles().add(0, true).add(90, true).add(0, true, "road").components();
  CHECK(components == std::vector<Component>{Component::roof, Component::wall, Component::ground});
  CHECK(name(Component::none) == "none");
  CHECK(name(Component::ground) == "ground");
  CHECK(name(Component::wall) == "wall");
  CHECK(name(Component::roof) == "roof");
  CHECK(name(Component::other) == "other");
  CHECK(Triangles().components().empty());
}
