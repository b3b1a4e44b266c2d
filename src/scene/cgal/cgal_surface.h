// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/glm.hpp>

/// The part of repair that CGAL does, with exact predicates. A library of its own, because CGAL wants its
/// users compiled with -frounding-math, which would slow down numeric code, and takes long to compile.
namespace sarnerf {

/// Turns triangles until neighbours agree, and gives triangles around edges that no surface passes
/// through (three or more faces, or a Möbius strip's seam) vertices of their own. Vertices are appended;
/// triangles keep their places.
void orient_with_cgal(std::vector<glm::dvec3>& vertices, std::vector<glm::uvec3>& triangles);

/// Whether the three points lie on one line; exact.
bool on_one_line(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

enum class Side { inside, outside, on_surface };

/// Tells on which side of a closed surface a point lies; exact, logarithmic in the number of triangles. Some of
/// them may be without area.
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
