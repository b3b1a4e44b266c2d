// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// A checker texture carried into the scene frame.
class PlacedChecker {
 public:
  /// `object_from_scene` takes scene-frame points to the coordinates in which the texture lives.
  PlacedChecker(const Texture& texture, const glm::dmat4& object_from_scene);

  /// Factor 1 ± contrast at a point of the scene frame.
  float factor(const glm::dvec3& scene_m) const;

  /// Fraction of the way from p to q at which the factor changes, when it changes once along a
  /// coordinate; one half when it cannot be told.
  double border(const glm::dvec3& p_m, const glm::dvec3& q_m) const;

 private:
  glm::dvec3 squares(const glm::dvec3& scene_m) const {
    return squares_from_scene_ * scene_m + shift_;
  }

  glm::dmat3 squares_from_scene_;  ///< to units of one square
  glm::dvec3 shift_;
  double contrast_;
};

/// Everything that decides γ at a hit apart from the geometry; triangles share it by index.
struct Appearance {
  float gamma0 = 1.0f;
  float exponent = 1.0f;
  bool two_sided = false;  ///< thin shell
  std::optional<PlacedChecker> checker;

  /// γ without texture; `cosine` is −n·d of unit vectors.
  float brightness(float cosine) const {
    const float c = two_sided ? std::abs(cosine) : std::max(cosine, 0.0f);
    if (exponent == 2.0f) return gamma0 * c * c;
    if (exponent == 1.0f) return gamma0 * c;
    if (exponent == 0.0f) return c > 0.0f ? gamma0 : 0.0f;
    return gamma0 * std::pow(c, exponent);
  }
};

/// Appearances of a scene's opaque triangles.
struct AppearanceTable {
  std::vector<Appearance> appearances;
  std::vector<std::uint16_t> of_triangle;  ///< indexed like the triangles given
};

/// `triangles`: indices into scene.mesh.triangles; `scene_origin_m`: world point that is the origin of
/// the scene frame. Throws UsageError for more than 65,535 different appearances.
AppearanceTable make_appearances(const Scene& scene, const std::vector<std::uint32_t>& triangles,
                                 const glm::dvec3& scene_origin_m);

/// Appearance of the ground plane.
Appearance ground_appearance(const Scene& scene, const glm::dvec3& scene_origin_m);

}  // namespace sarnerf
