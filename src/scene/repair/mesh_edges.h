// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "repair/repair.h"
#include "sarnerf/geometry/acquisition.h"
#include "triangle_soup.h"

namespace sarnerf {

/// One side of one triangle, stored under the lower index of its two vertices.
struct EdgeUse {
  std::uint32_t high;                ///< the other vertex
  std::uint32_t triangle_and_sense;  ///< twice the triangle, plus one if the side runs from high to low

  std::uint32_t triangle() const { return triangle_and_sense >> 1; }
  bool descending() const { return (triangle_and_sense & 1) != 0; }
};

/// Sorts `count` items by vertex, stably and in linear time: item n belongs to vertex_of(n). Calls place(n, slot)
/// with slots in the order of the vertices; returns where each vertex's slots begin, and the end of the last.
template <class VertexOf, class Place>
std::vector<std::uint32_t> file_by_vertex(std::size_t n_vertices, std::uint32_t count,
                                          VertexOf vertex_of, Place place) {
  std::vector<std::uint32_t> begin(n_vertices + 2, 0);
  for (std::uint32_t n = 0; n < count; ++n) ++begin[vertex_of(n) + 2];
  for (std::size_t v = 2; v < begin.size(); ++v) begin[v] += begin[v - 1];
  for (std::uint32_t n = 0; n < count; ++n) place(n, begin[vertex_of(n) + 1]++);
  begin.pop_back();
  return begin;
}

/// The sides of all triangles, grouped by edge: linear time, 8 bytes a side, no nodes, and the same order on
/// every machine. Triangles must have three different corners; there must be fewer than 2³⁰ of them.
class EdgeTable {
 public:
  EdgeTable(std::span<const glm::uvec3> triangles, std::size_t n_vertices)
      : uses_(3 * triangles.size()) {
    const auto corner = [&](std::uint32_t triangle, std::uint32_t c) {
      return triangles[triangle][static_cast<int>(c % 3)];
    };
    const auto from = [&](std::uint32_t side) { return corner(side / 3, side % 3); };
    const auto to = [&](std::uint32_t side) { return corner(side / 3, side % 3 + 1); };
    begin_ = file_by_vertex(
        n_vertices, static_cast<std::uint32_t>(uses_.size()),
        [&](std::uint32_t side) { return std::min(from(side), to(side)); },
        [&](std::uint32_t side, std::uint32_t slot) {
          uses_[slot] = {std::max(from(side), to(side)),
                         2 * (side / 3) + (from(side) > to(side) ? 1u : 0u)};
        });
    for (std::size_t v = 0; v + 1 < begin_.size(); ++v) {
      std::sort(uses_.begin() + begin_[v], uses_.begin() + begin_[v + 1],
                [](const EdgeUse& a, const EdgeUse& b) {
                  return a.high != b.high ? a.high < b.high
                                          : a.triangle_and_sense < b.triangle_and_sense;
                });
    }
  }

  /// Calls visit(std::span<const EdgeUse>) once for each edge.
  template <class Visit>
  void for_each(Visit visit) const {
    for (std::size_t v = 0; v + 1 < begin_.size(); ++v) {
      for (std::size_t first = begin_[v], last; first < begin_[v + 1]; first = last) {
        last = first + 1;
        while (last < begin_[v + 1] && uses_[last].high == uses_[first].high) ++last;
        visit(std::span<const EdgeUse>(uses_).subspan(first, last - first));
      }
    }
  }

 private:
  std::vector<EdgeUse> uses_;
  std::vector<std::uint32_t> begin_;  ///< per lower vertex
};

/// Whether two triangles run along their common edge in opposite directions: a surface passes through it.
inline bool is_smooth(std::span<const EdgeUse> edge) {
  return edge.size() == 2 && edge[0].descending() != edge[1].descending();
}

/// Union–find over triangles.
class Components {
 public:
  explicit Components(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  std::uint32_t root(std::uint32_t n) {
    while (parent_[n] != n) n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  /// The smaller index stays the root, so that roots come in the order of the triangles.
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Merges vertices that lie at exactly the same position and belong to faces of the same medium, and drops
/// vertices that no face uses. Returns how many were merged. CGAL's own function keeps the vertices in a
/// tree, which takes several times as long.
std::uint64_t weld_vertices(TriangleSoup& soup, std::span<const std::uint32_t> medium_of_material);

/// Drops faces that use a vertex twice. Returns how many.
std::uint64_t drop_repeated_corners(TriangleSoup& soup);

/// Keeps the triangles that `keep` marks, with their attributes.
void keep_triangles(TriangleSoup& soup, const std::vector<bool>& keep);

/// Merges vertices on open borders that only rounding separates: they are closer than 4e-6 of the mesh's
/// diagonal and closer than a hundredth of the shortest border edge at either vertex. Single precision causes
/// such gaps after a few transforms; modellers do not make gaps of that size on purpose. Inner vertices never
/// move, and faces of different media (separated by weld_vertices()) are not joined. Returns how many vertices
/// were merged into others. Linear time.
std::uint64_t stitch_borders(TriangleSoup& soup, std::span<const std::uint32_t> medium_of_material);

/// Properties that decide whether a connected piece is a solid, a cavity or a shell.
struct PieceShape {
  Box box;
  double signed_volume = 0.0;  ///< negative if the normals point inward
  bool closed = true;          ///< without a border, and not flat
  bool as_drawn = true;        ///< no face was reversed to agree with its neighbours
};

/// Fills mesh.piece: triangles joined by a smooth edge (is_smooth()) belong to one piece; pieces are numbered in
/// the order of their first triangles. `turned`: per triangle, whether orientation reversed it.
std::vector<PieceShape> find_pieces(RepairedMesh& mesh, const std::vector<bool>& turned);

inline constexpr std::uint32_t kNoPiece = 0xffffffffu;

/// For each piece the piece whose cavity it is, or kNoPiece. Cavities are closed pieces that were drawn facing
/// inward; each belongs to the smallest closed piece of the same medium around it that was drawn facing
/// outward. If all pieces face inward, the file is inside out and has no cavities.
std::vector<std::uint32_t> find_cavities(const RepairedMesh& mesh,
                                         const std::vector<PieceShape>& pieces,
                                         std::span<const std::uint32_t> medium_of_material,
                                         const Monitor& monitor);

/// Drops faces on the same three vertices, so that at most one face is left on them: see repair_mesh().
void drop_coincident_faces(TriangleSoup& soup, RepairCounts& counts);

}  // namespace sarnerf
