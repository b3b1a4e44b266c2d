// SPDX-License-Identifier: Apache-2.0
#include "appearance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

Appearance make_appearance(const Material& material, bool two_sided,
                           const glm::dmat4& object_from_world, const glm::dvec3& scene_origin_m,
                           double reach_m) {
  Appearance appearance;
  appearance.gamma0 = static_cast<float>(material.gamma0);
  appearance.exponent = static_cast<float>(material.exponent);
  appearance.two_sided = two_sided;
  if (material.texture.kind == Texture::Kind::checker && material.texture.contrast != 0.0) {
    const glm::dvec3 origin_in_object = glm::dvec3(object_from_world * glm::dvec4(scene_origin_m, 1.0));
    glm::dmat4 object_from_scene = object_from_world;
    object_from_scene[3] = glm::dvec4(origin_in_object, 1.0);
    appearance.checker.emplace(material.texture, object_from_scene);
    if (!appearance.checker->resolved_within(reach_m)) appearance.checker.reset();
  }
  return appearance;
}

/// Largest number of squares between origin and reach. Of single precision's 24 bits it leaves 6 for the position
/// within a square (with 4, the power of a block was 6 % off).
constexpr double kMostSquares = 1 << 18;

glm::dvec3 modulo_two(const glm::dvec3& v) { return v - 2.0 * glm::floor(0.5 * v); }

}  // namespace

PlacedChecker::PlacedChecker(const Texture& texture, const glm::dmat4& object_from_scene)
    : squares_from_scene_(glm::dmat3(object_from_scene) / texture.period_m),
      shift_(modulo_two((glm::dvec3(object_from_scene[3]) - texture.effective_origin_m()) /
                        texture.period_m)),
      squares_from_scene_single_(squares_from_scene_),
      shift_single_(shift_),
      reach_m_(kMostSquares * texture.period_m),
      even_(static_cast<float>(1.0 + texture.contrast)),
      odd_(static_cast<float>(1.0 - texture.contrast)) {}

double PlacedChecker::border(const glm::dvec3& p_m, const glm::dvec3& q_m) const {
  const glm::dvec3 p = squares(p_m), q = squares(q_m);
  double fraction = 0.5;
  int n_changes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t cell_p = whole_below(p[axis]), cell_q = whole_below(q[axis]);
    if (cell_p == cell_q) continue;
    fraction = (std::max(cell_p, cell_q) - p[axis]) / (q[axis] - p[axis]);
    n_changes += std::abs(cell_p - cell_q);
  }
  return n_changes == 1 ? std::clamp(fraction, 0.0, 1.0) : 0.5;
}

AppearanceTable make_appearances(const Scene& scene, const std::vector<std::uint32_t>& triangles,
                                 const glm::dvec3& scene_origin_m) {
  AppearanceTable table;
  const double reach_m = scene.box.empty() ? 0.0 : glm::length(scene.box.size());
  table.of_triangle.reserve(triangles.size());
  std::map<std::tuple<std::uint32_t, std::uint32_t, bool>, std::uint16_t> known;
  for (const std::uint32_t triangle : triangles) {
    const std::uint32_t material = scene.mesh.material[triangle];
    const Piece& piece = scene.pieces[scene.mesh.piece[triangle]];
    // Appearance depends on the object only through a texture.
    const bool textured = scene.materials[material].texture.kind != Texture::Kind::none;
    const std::tuple key{material, textured ? piece.object : 0u, !piece.closed};
    auto found = known.find(key);
    if (found == known.end()) {
      if (table.appearances.size() >= 65535) {
        throw UsageError("the scene has more than 65,535 combinations of material and object");
      }
      found = known.emplace(key, static_cast<std::uint16_t>(table.appearances.size())).first;
      table.appearances.push_back(make_appearance(scene.materials[material], !piece.closed,
                                                  scene.objects[piece.object].object_from_world,
                                                  scene_origin_m, reach_m));
    }
    table.of_triangle.push_back(found->second);
  }
  return table;
}

Appearance ground_appearance(const Scene& scene, const glm::dvec3& scene_origin_m) {
  return make_appearance(scene.materials[scene.ground->material], false, glm::dmat4(1.0),
                         scene_origin_m, 0.0);
}

Appearance ground_of_view(const Appearance& ground, const Acquisition& a, const glm::dvec3& aim_m) {
  const double swath_m = std::hypot(a.n_azimuth * a.azimuth_spacing_m,
                                    a.n_range * a.range_spacing_m / std::sin(a.incidence_rad));
  Appearance seen = ground;
  if (seen.checker && !seen.checker->resolved_within(glm::length(aim_m) + swath_m)) seen.checker.reset();
  return seen;
}

}  // namespace sarnerf
