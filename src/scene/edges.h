// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <numeric>
#include <span>
#include <vector>

namespace sarnerf {

/// One side of one triangle.
struct EdgeUse {
  std::uint32_t low, high;            ///< its vertices, in the order of their indices
  std::uint32_t triangle_and_sense;  ///< twice the triangle, plus one when it runs from high to low

  std::uint32_t triangle() const { return triangle_and_sense >> 1; }
  bool descending() const { return (triangle_and_sense & 1) != 0; }
};

/// The sides of all triangles, those of one edge together. Sorted rather than hashed: 12 bytes a side,
/// no nodes, the same order everywhere.
class EdgeTable {
 public:
  explicit EdgeTable(std::span<const glm::uvec3> triangles) {
    uses_.reserve(3 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t from = triangles[t][c], to = triangles[t][(c + 1) % 3];
        uses_.push_back({std::min(from, to), std::max(from, to), 2 * t + (from > to ? 1u : 0u)});
      }
    }
    std::sort(uses_.begin(), uses_.end(), [](const EdgeUse& a, const EdgeUse& b) {
      if (a.low != b.low) return a.low < b.low;
      if (a.high != b.high) return a.high < b.high;
      return a.triangle_and_sense < b.triangle_and_sense;
    });
  }

  /// Calls visit(std::span<const EdgeUse>) once for each edge.
  template <class Visit>
  void for_each(Visit visit) const {
    for (std::size_t begin = 0, end; begin < uses_.size(); begin = end) {
      end = begin + 1;
      while (end < uses_.size() && uses_[end].low == uses_[begin].low &&
             uses_[end].high == uses_[begin].high) {
        ++end;
      }
      visit(std::span<const EdgeUse>(uses_).subspan(begin, end - begin));
    }
  }

 private:
  std::vector<EdgeUse> uses_;
};

/// Two triangles that run along their common edge in opposite senses: a surface goes through.
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

}  // namespace sarnerf
