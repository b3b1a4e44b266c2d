// SPDX-License-Identifier: Apache-2.0
#include "pieces.h"

#include <cmath>

#include "edges.h"

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
    // Around a point of the piece itself, so that coordinates of millions of metres cancel.
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

}  // namespace sarnerf
