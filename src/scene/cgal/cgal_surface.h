// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/glm.hpp>

/// The part of repair that CGAL does, with exact predicates. It is a separate library because CGAL must be
/// compiled with -frounding-math, which would slow down numeric code, and because it takes long to compile.
namespace sarnerf {

/// Reverses triangles until neighbours agree. Splits edges through which no surface passes (three or more
/// faces, or a Möbius strip's seam): the triangles there get vertices of their own. Vertices are appended;
/// triangles keep their indices.
void orient_with_cgal(std::vector<glm::dvec3>& vertices, std::vector<glm::uvec3>& triangles);

/// Whether the three points lie on one line; exact.
bool on_one_line(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

enum class Side { inside, outside, on_surface };

/// Determines on which side of a closed surface a point lies; exact, logarithmic in the number of triangles.
/// Triangles without area are ignored.
class SideOfSurface {
 public:
  SideOfSurface(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles);
  ~SideOfSurface();
  Side of(const glm::dvec3& point) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sarnerf
