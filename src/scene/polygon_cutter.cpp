// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "triangle_soup.h"

namespace sarnerf {
namespace {

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// Twice the area vector of a polygon (Newell). Relative to its first corner, so that coordinates of
/// millions of metres lose nothing.
glm::dvec3 area_vector(const std::vector<glm::dvec3>& vertices,
                       std::span<const std::uint32_t> corners) {
  const glm::dvec3 origin = vertices[corners[0]];
  glm::dvec3 sum(0.0);
  for (std::size_t n = 1; n + 1 < corners.size(); ++n) {
    sum += glm::cross(vertices[corners[n]] - origin, vertices[corners[n + 1]] - origin);
  }
  return sum;
}

}  // namespace

void PolygonCutter::add_triangle(glm::uvec3 corners, std::uint32_t material, std::uint32_t group) {
  soup_.triangles.push_back(corners);
  soup_.material.push_back(material);
  soup_.group.push_back(group);
}

bool PolygonCutter::is_ear(std::size_t before, std::size_t tip, std::size_t after) const {
  const glm::dvec2 a = flat_[before], b = flat_[tip], c = flat_[after];
  if (!(cross(b - a, c - b) > 0.0)) return false;
  for (const glm::dvec2& p : flat_) {
    // Polygons with holes visit the corners of their bridge twice: a point on a corner is no obstacle.
    if (p == a || p == b || p == c) continue;
    if (cross(b - a, p - a) >= 0.0 && cross(c - b, p - b) >= 0.0 && cross(a - c, p - c) >= 0.0) {
      return false;
    }
  }
  return true;
}

void PolygonCutter::add(std::span<const std::uint32_t> corners, std::uint32_t material,
                        std::uint32_t group) {
  if (corners.size() < 3) {
    ++soup_.n_ignored_faces;
    return;
  }
  if (corners.size() == 3) {
    add_triangle({corners[0], corners[1], corners[2]}, material, group);
    return;
  }

  const glm::dvec3 normal = area_vector(soup_.vertices, corners);
  const glm::dvec3 size = glm::abs(normal);
  const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const int u = (drop + 1) % 3, v = (drop + 2) % 3;
  const glm::dvec3 origin = soup_.vertices[corners[0]];
  ring_.assign(corners.begin(), corners.end());
  flat_.clear();
  for (const std::uint32_t corner : corners) {
    const glm::dvec3 p = soup_.vertices[corner] - origin;
    flat_.emplace_back(p[u], normal[drop] < 0.0 ? -p[v] : p[v]);
  }

  bool tangled = false;
  std::size_t tip = 1;
  while (ring_.size() > 3) {
    const std::size_t n = ring_.size();
    std::size_t tried = 0;
    while (tried < n && !is_ear((tip + n - 1) % n, tip, (tip + 1) % n)) {
      tip = (tip + 1) % n;
      ++tried;
    }
    // Corners on one line are cut off as triangles without area; a polygon that crosses itself has
    // no right answer. Both end here, and every round removes a corner.
    if (tried == n) {
      const auto bend = [&](std::size_t t) {
        return cross(flat_[t] - flat_[(t + n - 1) % n], flat_[(t + 1) % n] - flat_[t]);
      };
      std::size_t flattest = 0;
      for (std::size_t t = 1; t < n; ++t) {
        if (std::abs(bend(t)) < std::abs(bend(flattest))) flattest = t;
      }
      tangled |= bend(flattest) != 0.0;
      tip = flattest;
    }
    add_triangle({ring_[(tip + n - 1) % n], ring_[tip], ring_[(tip + 1) % n]}, material, group);
    ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(tip));
    flat_.erase(flat_.begin() + static_cast<std::ptrdiff_t>(tip));
    tip %= ring_.size();
  }
  add_triangle({ring_[0], ring_[1], ring_[2]}, material, group);
  if (tangled) ++soup_.n_tangled_faces;
}

}  // namespace sarnerf
