// SPDX-License-Identifier: Apache-2.0
#include "scene_pieces.h"

#include <algorithm>

namespace sarnerf::bench {

ScenePiece loft(const std::string& group, const std::string& material, const std::vector<Ring>& rings) {
  ScenePiece piece{group, material, {}, {}};
  for (const Ring& ring : rings) piece.vertices_m.insert(piece.vertices_m.end(), ring.begin(), ring.end());
  std::uint32_t a = 0;  // first corner of the ring
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    const auto n_a = static_cast<std::uint32_t>(rings[r].size()), n_b = static_cast<std::uint32_t>(rings[r + 1].size());
    const std::uint32_t n = std::max(n_a, n_b), b = a + n_a;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t next = (i + 1) % n;
      if (n_a > 1) piece.triangles.emplace_back(a + i, a + next, b + next % n_b);
      if (n_b > 1) piece.triangles.emplace_back(a + i % n_a, b + next, b + i);
    }
    a = b;
  }
  for (std::uint32_t i = 1; i + 1 < rings.front().size(); ++i) piece.triangles.emplace_back(0, i + 1, i);
  for (std::uint32_t i = 1; i + 1 < rings.back().size(); ++i) piece.triangles.emplace_back(a, a + i, a + i + 1);
  return piece;
}

Ring polygon(const glm::dvec3& centre, const glm::dvec3& u, const glm::dvec3& v, int n_corners) {
  Ring ring;
  for (int i = 0; i < n_corners; ++i) {
    const double angle = 2.0 * kPi * i / n_corners;
    ring.push_back(centre + std::sin(angle) * u - std::cos(angle) * v);
  }
  return ring;
}

ScenePiece cylinder(const std::string& group, const std::string& material, const glm::dvec3& from, const glm::dvec3& to,
                    double radius, int n_facets) {
  const glm::dvec3 axis = glm::normalize(to - from);
  // Near the vertical or, for a standing cylinder, near X; a wheel then has a corner at its lowest point.
  const glm::dvec3 near_v = std::abs(axis.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(near_v, axis)), v = glm::cross(axis, u);
  return loft(group, material,
              {polygon(from, radius * u, radius * v, n_facets), polygon(to, radius * u, radius * v, n_facets)});
}

Ring rectangle(double y, const glm::dvec2& min_xz, const glm::dvec2& max_xz) {
  return {{min_xz.x, y, max_xz.y}, {max_xz.x, y, max_xz.y}, {max_xz.x, y, min_xz.y}, {min_xz.x, y, min_xz.y}};
}

ScenePiece box(const std::string& group, const std::string& material, const glm::dvec3& min, const glm::dvec3& max) {
  return loft(group, material,
              {rectangle(min.y, {min.x, min.z}, {max.x, max.z}), rectangle(max.y, {min.x, min.z}, {max.x, max.z})});
}

Box box_of(std::span<const ScenePiece> pieces) {
  Box bounds;
  for (const ScenePiece& piece : pieces) {
    for (const glm::dvec3& p : piece.vertices_m) bounds.include(p);
  }
  return bounds;
}

void move(ScenePiece& piece, const glm::dvec3& by) {
  for (glm::dvec3& p : piece.vertices_m) p += by;
}

void turn_about_y(ScenePiece& piece, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  for (glm::dvec3& p : piece.vertices_m) p = {c * p.x + s * p.z, p.y, c * p.z - s * p.x};
}

void fit(Pieces& pieces, double length_m, double height_m) {
  const glm::dvec3 size = box_of(pieces).size();
  const double across = length_m / std::max(size.x, size.z), up = height_m / size.y;
  for (ScenePiece& piece : pieces) {
    for (glm::dvec3& p : piece.vertices_m) p *= glm::dvec3(across, up, across);
  }
}

}  // namespace sarnerf::bench
