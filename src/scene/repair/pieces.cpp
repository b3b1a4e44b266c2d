// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#define BOOST_ALLOW_DEPRECATED_HEADERS  // Boost 1.74 includes one itself
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>

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

namespace index = boost::geometry::index;
using IndexedPoint = boost::geometry::model::point<double, 3, boost::geometry::cs::cartesian>;
using IndexedBox = boost::geometry::model::box<IndexedPoint>;

IndexedBox indexed(const Box& box) {
  return {{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}};
}

/// Finds which of many boxes enclose another box: logarithmic in their number unless they all overlap.
class BoxTree {
 public:
  explicit BoxTree(std::span<const Box> boxes) {
    std::vector<Numbered> numbered;
    numbered.reserve(boxes.size());
    for (const Box& box : boxes) numbered.emplace_back(indexed(box), static_cast<std::uint32_t>(numbered.size()));
    tree_ = Tree(numbered);  // of a whole range the tree is packed at once
  }

  /// Numbers of the boxes that enclose `inner`, ascending; replaces `found`.
  void enclosing(const Box& inner, std::vector<std::uint32_t>& found) const {
    found.clear();
    for (auto entry = tree_.qbegin(index::covers(indexed(inner))); entry != tree_.qend(); ++entry) found.push_back(entry->second);
    std::sort(found.begin(), found.end());
  }

 private:
  using Numbered = std::pair<IndexedBox, std::uint32_t>;
  using Tree = index::rtree<Numbered, index::quadratic<16>>;
  Tree tree_;
};

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
