// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include "box_tree.h"
#include "cgal_surface.h"
#include "pieces.h"

namespace sarnerf {
namespace {

/// Triangles of each piece, and tests of what lies inside it, made when first asked for.
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

  /// Decided by the first vertex of `inner` that does not touch `outer`.
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

  // From the smallest: the first that holds a piece is the one right around it.
  std::stable_sort(outward.begin(), outward.end(), [&](std::uint32_t a, std::uint32_t b) {
    return pieces[a].signed_volume < pieces[b].signed_volume;
  });
  // There may be a million of either.
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
