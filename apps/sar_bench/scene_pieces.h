// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "random_scenes.h"
#include "sarnerf/core/units.h"

namespace sarnerf::bench {

/// Random numbers that are the same on every platform; those of the standard library's distributions need not be. C++
/// does not define in which order the arguments of a call are evaluated: two draws stand in braces, which fix their
/// order, or in separate statements.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}

  double uniform(double least, double most) { return least + (most - least) * unit(); }
  double log_uniform(double least, double most) { return least * std::pow(most / least, unit()); }
  int whole(int least, int most) { return least + static_cast<int>((most - least + 1) * unit()); }
  bool chance(double probability) { return unit() < probability; }
  double angle_rad() { return uniform(0.0, 2.0 * kPi); }

  glm::dvec3 direction() {
    const double y = uniform(-1.0, 1.0), around = angle_rad(), across = std::sqrt(1.0 - y * y);
    return {across * std::cos(around), y, across * std::sin(around)};
  }

 private:
  double unit() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }

  std::mt19937_64 bits_;
};

using Pieces = std::vector<ScenePiece>;

// Closed meshes. All but the free forms and the rings are lofts: rings of corners one behind the other, joined by walls.

using Ring = std::vector<glm::dvec3>;

/// The solid along a path of convex rings of equally many corners, counter-clockwise seen from the end of the path. The
/// first and the last ring are its caps; either may be a single corner, a tip.
ScenePiece loft(const std::string& group, const std::string& material, const std::vector<Ring>& rings);

/// Corners of a regular polygon, stretched along u and v and beginning at −v; counter-clockwise seen from u × v.
Ring polygon(const glm::dvec3& centre, const glm::dvec3& u, const glm::dvec3& v, int n_corners);

ScenePiece cylinder(const std::string& group, const std::string& material, const glm::dvec3& from, const glm::dvec3& to,
                    double radius, int n_facets);

/// Counter-clockwise seen from above.
Ring rectangle(double y, const glm::dvec2& min_xz, const glm::dvec2& max_xz);

ScenePiece box(const std::string& group, const std::string& material, const glm::dvec3& min, const glm::dvec3& max);

Box box_of(std::span<const ScenePiece> pieces);
void move(ScenePiece& piece, const glm::dvec3& by);
void turn_about_y(ScenePiece& piece, double angle_rad);

/// Scales all pieces together to a longest horizontal extent and, by another factor, to a height.
void fit(Pieces& pieces, double length_m, double height_m);

/// The pieces of a shape (random_scene() of the seeds 200 to 299).
Pieces random_shape(Random& random, SceneKind kind);

}  // namespace sarnerf::bench
