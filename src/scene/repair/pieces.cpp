// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "cgal/cgal_surface.h"
#include "repair/mesh_edges.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

std::vector<PieceShape> find_pieces(RepairedMesh& mesh, const std::vector<bool>& turned) {
  Components components(mesh.triangles.size());
  std::vector<bool> has_border(mesh.triangles.size(), false);
  {
    const EdgeTable edges(mesh.triangles, mesh.vertices.size());
    edges.for_each([&](std::span<const EdgeUse> edge) {
      if (is_smooth(edge)) {
        components.join(edge[0].triangle(), edge[1].triangle());
      } else {
        for (const EdgeUse& use : edge) has_border[use.triangle()] = true;
      }
    });
  }

  mesh.piece.resize(mesh.triangles.size());
  std::vector<PieceShape> pieces;
  std::vector<glm::dvec3> origins;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t root = components.root(t);
    const glm::uvec3 v = mesh.triangles[t];
    if (root == t) {
      mesh.piece[t] = static_cast<std::uint32_t>(pieces.size());
      pieces.emplace_back();
      origins.push_back(mesh.vertices[v.x]);
    } else {
      mesh.piece[t] = mesh.piece[root];
    }
    PieceShape& piece = pieces[mesh.piece[t]];
    if (has_border[t]) piece.closed = false;
    if (turned[t]) piece.as_drawn = false;
    // Relative to a point of the piece itself, so that coordinates of millions of metres cancel.
    const glm::dvec3 origin = origins[mesh.piece[t]];
    const glm::dvec3 a = mesh.vertices[v.x], b = mesh.vertices[v.y], c = mesh.vertices[v.z];
    piece.signed_volume += glm::dot(a - origin, glm::cross(b - origin, c - origin)) / 6.0;
    piece.box.include(a);
    piece.box.include(b);
    piece.box.include(c);
  }
  for (PieceShape& piece : pieces) {
    // A sheet folded onto itself has no border and encloses nothing but rounding errors.
    constexpr double kRounding = 1e-12;
    const double size = glm::length(piece.box.size());
    if (!(std::abs(piece.signed_volume) > kRounding * size * size * size)) piece.closed = false;
  }
  return pieces;
}

namespace {

bool encloses(const Box& outer, const Box& inner) {
  return glm::all(glm::lessThanEqual(outer.min, inner.min)) && glm::all(glm::greaterThanEqual(outer.max, inner.max));
}

/// Finds which of many boxes enclose another box: logarithmic in their number unless they all overlap.
class BoxTree {
 public:
  explicit BoxTree(std::span<const Box> boxes);

  /// Numbers of the boxes that enclose `inner`, ascending; replaces `found`.
  void enclosing(const Box& inner, std::vector<std::uint32_t>& found) const;

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  ///< range of order_ in a leaf; count 0: `first` is the second child
  };

  std::uint32_t build(std::uint32_t first, std::uint32_t count);

  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;  ///< a node's first child follows it
};

constexpr std::uint32_t kLeafBoxes = 4;

BoxTree::BoxTree(std::span<const Box> boxes) : boxes_(boxes.begin(), boxes.end()), order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!boxes_.empty()) build(0, static_cast<std::uint32_t>(boxes_.size()));
}

std::uint32_t BoxTree::build(std::uint32_t first, std::uint32_t count) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Box box, centres;
  for (std::uint32_t n = first; n < first + count; ++n) {
    box.include(boxes_[order_[n]].min);
    box.include(boxes_[order_[n]].max);
    centres.include(boxes_[order_[n]].centre());
  }
  nodes_[number].box = box;
  if (count <= kLeafBoxes) {
    nodes_[number].first = first;
    nodes_[number].count = count;
    return number;
  }
  // Two halves of equal count along the longest side, so the depth is logarithmic for any boxes.
  const glm::dvec3 size = centres.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    return boxes_[a].centre()[axis] < boxes_[b].centre()[axis];
  });
  build(first, count / 2);
  const std::uint32_t second = build(first + count / 2, count - count / 2);
  nodes_[number].first = second;
  return number;
}

void BoxTree::enclosing(const Box& inner, std::vector<std::uint32_t>& found) const {
  found.clear();
  std::vector<std::uint32_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::uint32_t number = open.back();
    open.pop_back();
    const Node& node = nodes_[number];
    if (!encloses(node.box, inner)) continue;
    if (node.count == 0) {
      open.push_back(number + 1);
      open.push_back(node.first);
      continue;
    }
    for (std::uint32_t n = node.first; n < node.first + node.count; ++n) {
      if (encloses(boxes_[order_[n]], inner)) found.push_back(order_[n]);
    }
  }
  std::sort(found.begin(), found.end());
}

/// Triangles of each piece, and its inside test, which is built on first use.
class PieceInteriors {
 public:
  explicit PieceInteriors(const RepairedMesh& mesh, std::size_t n_pieces)
      : mesh_(mesh), begin_(n_pieces + 1, 0), triangles_(mesh.triangles.size()) {
    for (const std::uint32_t p : mesh.piece) ++begin_[p + 1];
    for (std::size_t p = 0; p < n_pieces; ++p) begin_[p + 1] += begin_[p];
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t t = 0; t < mesh.piece.size(); ++t) triangles_[next[mesh.piece[t]]++] = t;
  }

  std::span<const std::uint32_t> triangles(std::uint32_t piece) const {
    return std::span(triangles_).subspan(begin_[piece], begin_[piece + 1] - begin_[piece]);
  }

  /// Tests the first vertex of `inner` that does not touch `outer`.
  bool contains(std::uint32_t outer, std::uint32_t inner) {
    const SideOfSurface& side = test_of(outer);
    for (const std::uint32_t t : triangles(inner)) {
      for (int c = 0; c < 3; ++c) {
        const Side found = side.of(mesh_.vertices[mesh_.triangles[t][c]]);
        if (found != Side::on_surface) return found == Side::inside;
      }
    }
    return false;
  }

 private:
  const SideOfSurface& test_of(std::uint32_t piece) {
    std::unique_ptr<SideOfSurface>& test = tests_[piece];
    if (test) return *test;
    std::vector<glm::dvec3> vertices;
    std::vector<glm::uvec3> local;
    std::unordered_map<std::uint32_t, std::uint32_t> index;
    for (const std::uint32_t t : triangles(piece)) {
      glm::uvec3 corners;
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t vertex = mesh_.triangles[t][c];
        const auto [entry, is_new] =
            index.try_emplace(vertex, static_cast<std::uint32_t>(vertices.size()));
        if (is_new) vertices.push_back(mesh_.vertices[vertex]);
        corners[c] = entry->second;
      }
      local.push_back(corners);
    }
    test = std::make_unique<SideOfSurface>(vertices, local);
    return *test;
  }

  const RepairedMesh& mesh_;
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> triangles_;
  std::map<std::uint32_t, std::unique_ptr<SideOfSurface>> tests_;
};

}  // namespace

std::vector<std::uint32_t> find_cavities(const RepairedMesh& mesh,
                                         const std::vector<PieceShape>& pieces,
                                         std::span<const std::uint32_t> medium_of_material,
                                         const Monitor& monitor) {
  std::vector<std::uint32_t> container(pieces.size(), kNoPiece);
  std::vector<std::uint32_t> inward, outward;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    if (!pieces[p].closed || !pieces[p].as_drawn) continue;
    (pieces[p].signed_volume < 0.0 ? inward : outward).push_back(p);
  }
  if (inward.empty() || outward.empty()) return container;

  // Smallest first: the first that contains a piece is its direct container.
  std::stable_sort(outward.begin(), outward.end(), [&](std::uint32_t a, std::uint32_t b) {
    return pieces[a].signed_volume < pieces[b].signed_volume;
  });
  // A tree, because there may be a million of either.
  std::vector<Box> boxes;
  for (const std::uint32_t outer : outward) boxes.push_back(pieces[outer].box);
  const BoxTree around(boxes);
  PieceInteriors interiors(mesh, pieces.size());
  const auto medium = [&](std::uint32_t piece) {
    return medium_of_material[mesh.material[interiors.triangles(piece).front()]];
  };
  std::vector<std::uint32_t> candidates;
  for (const std::uint32_t p : inward) {
    monitor.check();
    around.enclosing(pieces[p].box, candidates);
    for (const std::uint32_t place : candidates) {
      const std::uint32_t outer = outward[place];
      if (medium(outer) != medium(p) || !interiors.contains(outer, p)) continue;
      container[p] = outer;
      break;
    }
  }
  return container;
}

}  // namespace sarnerf
