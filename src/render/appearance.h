// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// A checker texture in scene-frame coordinates.
class PlacedChecker {
 public:
  /// `object_from_scene` maps scene-frame points to the object coordinates of the texture.
  PlacedChecker(const Texture& texture, const glm::dmat4& object_from_scene);

  /// Factor 1 ± contrast at a point of the scene frame; single precision is enough within resolved_within().
  float factor(const glm::vec3& scene_m) const {
    const glm::vec3 p = squares_from_scene_single_ * scene_m + shift_single_;
    const std::int32_t parity = whole_below(p.x) ^ whole_below(p.y) ^ whole_below(p.z);
    return (parity & 1) != 0 ? odd_ : even_;
  }

  /// Whether single precision resolves neighbouring squares this far from the scene frame's origin.
  /// Farther away rounding favours even squares, and the pattern loses its mean of 1.
  bool resolved_within(double reach_m) const { return reach_m <= reach_m_; }

  /// Fraction of the way from p to q at which the factor changes, if exactly one border between squares
  /// lies in between; else one half.
  double border(const glm::dvec3& p_m, const glm::dvec3& q_m) const;

 private:
  /// Floor. std::floor would be a library call in the baseline instruction set.
  template <class Real>
  static std::int32_t whole_below(Real x) {
    constexpr Real kFarthest = 1e9f;  // single precision resolves no pattern beyond this
    const Real bounded = std::min(std::max(x, -kFarthest), kFarthest);
    const auto truncated = static_cast<std::int32_t>(bounded);
    return truncated - static_cast<std::int32_t>(bounded < static_cast<Real>(truncated));
  }

  glm::dvec3 squares(const glm::dvec3& scene_m) const {
    return squares_from_scene_ * scene_m + shift_;
  }

  glm::dmat3 squares_from_scene_;  ///< to units of one square
  glm::dvec3 shift_;               ///< modulo 2, the pattern's period, so that it stays small for distant objects
  glm::mat3 squares_from_scene_single_;
  glm::vec3 shift_single_;
  double reach_m_;    ///< see resolved_within()
  float even_, odd_;  ///< factors of the squares
};

/// Cosine of incidence for scattering: a closed piece scatters from its outer side only, a thin shell from both.
inline float facing(float cosine, bool two_sided) {
  return two_sided ? std::abs(cosine) : std::max(cosine, 0.0f);
}

/// Everything that determines γ at a hit except the geometry. Triangles refer to it by index.
struct Appearance {
  float gamma0 = 1.0f;
  float exponent = 1.0f;
  bool two_sided = false;  ///< thin shell
  std::optional<PlacedChecker> checker;

  /// γ without texture; `cosine` is −n·d of unit vectors.
  float brightness(float cosine) const {
    const float c = facing(cosine, two_sided);
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
/// the scene frame. Checkers too fine for single precision over the scene's box are replaced by their mean of
/// 1. Throws UsageError for more than 65,535 different appearances.
AppearanceTable make_appearances(const Scene& scene, const std::vector<std::uint32_t>& triangles,
                                 const glm::dvec3& scene_origin_m);

/// Appearance of the ground plane, always with its checker: the reach depends on the view, see ground_of_view().
Appearance ground_appearance(const Scene& scene, const glm::dvec3& scene_origin_m);

/// The ground's appearance in a view: without its checker if that is too fine for the view's reach.
/// `aim_m`: the aim point in the scene frame.
Appearance ground_of_view(const Appearance& ground, const Acquisition& acquisition, const glm::dvec3& aim_m);

}  // namespace sarnerf
