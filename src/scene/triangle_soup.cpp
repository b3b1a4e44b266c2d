// SPDX-License-Identifier: Apache-2.0
#include "triangle_soup.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

constexpr std::uint64_t kPerVertex = 50;
constexpr std::uint64_t kPerTriangle = 90;
constexpr std::uint64_t kPerOrientedTriangle = 350;

[[noreturn]] void refuse(const std::string& name, const std::string& what, std::uint64_t needed,
                         std::uint64_t limit, const std::string& fits) {
  throw UsageError(name + ": " + what + " needs about " + human_bytes(needed) +
                   " of memory, and " + human_bytes(limit) + " are available (--max-memory)" + fits);
}

}  // namespace

std::uint64_t MemoryBudget::mesh_bytes(std::uint64_t n_vertices, std::uint64_t n_triangles) {
  return 24 * n_vertices + 24 * n_triangles;
}

void MemoryBudget::require_file(std::uint64_t bytes, const std::string& name) const {
  if (limit_bytes_ == 0 || kept_bytes_ + bytes <= limit_bytes_) return;
  refuse(name, "holding the file", kept_bytes_ + bytes, limit_bytes_,
         "; raise it, or store the mesh as binary PLY, which is half the size of text");
}

void MemoryBudget::require_mesh(std::uint64_t n_vertices, std::uint64_t n_triangles,
                                const std::string& name) const {
  if (limit_bytes_ == 0) return;
  const std::uint64_t needed = kept_bytes_ + kPerVertex * n_vertices + kPerTriangle * n_triangles;
  if (needed <= limit_bytes_) return;
  const std::uint64_t available = limit_bytes_ - std::min(kept_bytes_, limit_bytes_);
  // Assumes the same ratio of vertices to triangles.
  const double share = static_cast<double>(available) / static_cast<double>(needed - kept_bytes_);
  const auto fits = static_cast<std::uint64_t>(share * static_cast<double>(n_triangles));
  refuse(name,
         "reading " + counted(n_triangles, "triangle", "triangles") + " on " +
             counted(n_vertices, "vertex", "vertices"),
         needed, limit_bytes_,
         ", enough for about " + counted(fits, "triangle", "triangles") +
             "; raise it or use a coarser mesh");
}

void MemoryBudget::require_orientation(std::uint64_t n_triangles, const std::string& name) const {
  if (limit_bytes_ == 0) return;
  const std::uint64_t needed = kept_bytes_ + kPerOrientedTriangle * n_triangles;
  if (needed <= limit_bytes_) return;
  const std::uint64_t available = limit_bytes_ - std::min(kept_bytes_, limit_bytes_);
  refuse(name,
         "orienting " + counted(n_triangles, "triangle", "triangles") +
             " whose neighbours are oriented oppositely",
         needed, limit_bytes_,
         ", enough for about " +
             counted(available / kPerOrientedTriangle, "triangle", "triangles") +
             "; raise it, or orient the mesh where it was made");
}

namespace {

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// Twice the area vector of a polygon (Newell). Relative to its first corner, so that coordinates of
/// millions of metres lose no precision.
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

/// A corner found outside an ear stays outside until the ear changes, and a corner that was cut never
/// returns. So the search resumes where it stopped, and all searches together cost the square of the number
/// of corners for any polygon.
bool PolygonCutter::is_ear(std::uint32_t tip) {
  Corner& corner = ring_[tip];
  const glm::dvec2 a = flat_[corner.before], b = flat_[tip], c = flat_[corner.behind];
  if (!(cross(b - a, c - b) > 0.0)) return false;
  for (; corner.n_outside < flat_.size(); ++corner.n_outside) {
    const glm::dvec2 p = flat_[corner.n_outside];  // NaN if cut off: no comparison holds
    const bool inside =
        cross(b - a, p - a) >= 0.0 && cross(c - b, p - b) >= 0.0 && cross(a - c, p - c) >= 0.0;
    // Polygons with holes visit the corners of their bridge twice: a point on a corner does not block the ear.
    if (inside && p != a && p != b && p != c) return false;
  }
  return true;
}

double PolygonCutter::bend(std::uint32_t tip) const {
  const Corner& corner = ring_[tip];
  return cross(flat_[tip] - flat_[corner.before], flat_[corner.behind] - flat_[tip]);
}

std::uint32_t PolygonCutter::flattest(std::uint32_t first) const {
  std::uint32_t found = first;
  for (std::uint32_t n = ring_[first].behind; n != first; n = ring_[n].behind) {
    if (std::abs(bend(n)) < std::abs(bend(found))) found = n;
  }
  return found;
}

void PolygonCutter::cut(std::uint32_t tip) {
  const Corner& corner = ring_[tip];
  flat_[tip] = glm::dvec2(std::numeric_limits<double>::quiet_NaN());
  ring_[corner.before].behind = corner.behind;
  ring_[corner.behind].before = corner.before;
  ring_[corner.before].n_outside = ring_[corner.behind].n_outside = 0;
}

void PolygonCutter::lay_flat(std::span<const std::uint32_t> corners) {
  const glm::dvec3 normal = area_vector(soup_.vertices, corners);
  const glm::dvec3 size = glm::abs(normal);
  const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const int u = (drop + 1) % 3, v = (drop + 2) % 3;
  const glm::dvec3 origin = soup_.vertices[corners[0]];
  const auto n_corners = static_cast<std::uint32_t>(corners.size());
  ring_.clear();
  flat_.clear();
  for (std::uint32_t n = 0; n < n_corners; ++n) {
    const glm::dvec3 p = soup_.vertices[corners[n]] - origin;
    flat_.emplace_back(p[u], normal[drop] < 0.0 ? -p[v] : p[v]);
    ring_.push_back({(n + n_corners - 1) % n_corners, (n + 1) % n_corners, 0});
  }
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

  lay_flat(corners);
  const auto triangle_at = [&](std::uint32_t tip) {
    return glm::uvec3(corners[ring_[tip].before], corners[tip], corners[ring_[tip].behind]);
  };
  bool tangled = false;
  std::uint32_t first = 0, tip = 1;
  for (std::size_t n_left = corners.size(); n_left > 3; --n_left) {
    std::size_t tried = 0;
    while (tried < n_left && !is_ear(tip)) {
      tip = ring_[tip].behind;
      ++tried;
    }
    // No ear is left: either the corners lie on one line and give triangles without area, or the polygon
    // crosses itself and has no correct triangulation. Every round removes a corner all the same.
    if (tried == n_left) {
      tip = flattest(first);
      tangled |= bend(tip) != 0.0;
    }
    add_triangle(triangle_at(tip), material, group);
    cut(tip);
    if (tip == first) first = ring_[tip].behind;
    tip = ring_[tip].behind;
  }
  add_triangle(triangle_at(ring_[first].behind), material, group);
  if (tangled) ++soup_.n_tangled_faces;
}

}  // namespace sarnerf
