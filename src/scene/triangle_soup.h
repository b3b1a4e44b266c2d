// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <glm/glm.hpp>

namespace sarnerf {

/// Names with indices in the order of their first appearance.
class NameTable {
 public:
  std::uint32_t index(std::string_view name) {
    const auto [entry, is_new] =
        index_of_.try_emplace(std::string(name), static_cast<std::uint32_t>(names_.size()));
    if (is_new) names_.emplace_back(name);
    return entry->second;
  }
  const std::string& operator[](std::uint32_t n) const { return names_[n]; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::unordered_map<std::string, std::uint32_t> index_of_;
};

/// A mesh as stored in its file: file units and axes, neither welded nor repaired. Every vertex is finite
/// and every index in range; polygons have been cut into triangles.
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

/// Largest number of corners for PolygonCutter::add(): its cost is their square in the worst case.
inline constexpr std::size_t kMaxCorners = 4096;

/// Cuts polygons into triangles and adds them to a soup. Keeps its scratch space from call to call.
class PolygonCutter {
 public:
  explicit PolygonCutter(TriangleSoup& soup) : soup_(soup) {}

  /// `corners`: indices of vertices that the soup already holds, at most kMaxCorners. Concave polygons are
  /// cut by ear clipping in the plane that fits them best; triangles keep the polygon's orientation.
  void add(std::span<const std::uint32_t> corners, std::uint32_t material, std::uint32_t group);

 private:
  /// A corner in the ring of those that remain.
  struct Corner {
    std::uint32_t before = 0, behind = 0;
    std::uint32_t n_outside = 0;  ///< the first n_outside corners are known to lie outside its ear
  };

  void add_triangle(glm::uvec3 corners, std::uint32_t material, std::uint32_t group);
  void lay_flat(std::span<const std::uint32_t> corners);
  bool is_ear(std::uint32_t tip);
  double bend(std::uint32_t tip) const;
  std::uint32_t flattest(std::uint32_t first) const;
  void cut(std::uint32_t tip);

  TriangleSoup& soup_;
  std::vector<Corner> ring_;
  std::vector<glm::dvec2> flat_;  ///< projected corners, counter-clockwise; NaN once cut off
};

/// Refuses a mesh before it is allocated. Estimates are of the peak, with the file in memory; they were
/// measured on meshes of 1.2 million triangles and rounded up.
class MemoryBudget {
 public:
  /// `limit_bytes`: 0 for no limit.
  explicit MemoryBudget(std::uint64_t limit_bytes = 0) : limit_bytes_(limit_bytes) {}

  /// Adds memory that stays allocated from now on: the bytes of a file, or the meshes read before.
  void add_kept(std::uint64_t bytes) { kept_bytes_ += bytes; }

  /// Throws UsageError, with the memory needed and allowed, when a file of this many bytes is too large.
  void require_file(std::uint64_t bytes, const std::string& name) const;

  /// The same for reading and cleaning a mesh of this many vertices and triangles; reports how many would fit.
  void require_mesh(std::uint64_t n_vertices, std::uint64_t n_triangles,
                    const std::string& name) const;

  /// The same for orienting triangles whose neighbours disagree, which takes several times as much memory.
  void require_orientation(std::uint64_t n_triangles, const std::string& name) const;

  /// Bytes that a mesh keeps occupied in a scene.
  static std::uint64_t mesh_bytes(std::uint64_t n_vertices, std::uint64_t n_triangles);

 private:
  std::uint64_t limit_bytes_;
  std::uint64_t kept_bytes_ = 0;
};

}  // namespace sarnerf
