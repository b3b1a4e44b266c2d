// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "name_table.h"

namespace sarnerf {

/// A mesh as its file gives it: file units and axes, nothing welded, nothing mended. Every vertex is
/// finite and every index in range; polygons have been cut into triangles.
struct TriangleSoup {
  std::vector<glm::dvec3> vertices;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> material;  ///< per triangle, index into materials
  std::vector<std::uint32_t> group;     ///< per triangle, index into groups
  NameTable materials;                  ///< "" where the file names none
  NameTable groups;                     ///< "" where the file names none
  bool single_precision = false;        ///< vertices are stored as float32
  std::uint64_t n_ignored_faces = 0;    ///< with fewer than three corners
  std::uint64_t n_tangled_faces = 0;    ///< polygons that cross themselves

  void reserve(std::size_t n_vertices, std::size_t n_triangles) {
    vertices.reserve(n_vertices);
    triangles.reserve(n_triangles);
    material.reserve(n_triangles);
    group.reserve(n_triangles);
  }
};

/// Most corners that PolygonCutter::add() takes: cutting takes their square in the worst case.
inline constexpr std::size_t kMaxCorners = 4096;

/// Cuts polygons into triangles and adds them to a soup. Keeps its scratch space from call to call.
class PolygonCutter {
 public:
  explicit PolygonCutter(TriangleSoup& soup) : soup_(soup) {}

  /// `corners`: indices of vertices that the soup already holds, at most kMaxCorners. Concave polygons
  /// are cut by clipping ears in the plane that fits them best; triangles keep the polygon's sense.
  void add(std::span<const std::uint32_t> corners, std::uint32_t material, std::uint32_t group);

 private:
  /// A corner in the ring of those that are still there.
  struct Corner {
    std::uint32_t before = 0, behind = 0;
    std::uint32_t n_outside = 0;  ///< corners, from the first one on, known to lie outside of its ear
  };

  void add_triangle(glm::uvec3 corners, std::uint32_t material, std::uint32_t group);
  void lay_flat(std::span<const std::uint32_t> corners);
  bool is_ear(std::uint32_t tip);
  double bend(std::uint32_t tip) const;
  std::uint32_t flattest(std::uint32_t first) const;
  void cut(std::uint32_t tip);

  TriangleSoup& soup_;
  std::vector<Corner> ring_;
  std::vector<glm::dvec2> flat_;  ///< where they lie in the plane, counter-clockwise; NaN once cut off
};

}  // namespace sarnerf
