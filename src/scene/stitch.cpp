// SPDX-License-Identifier: Apache-2.0
#include "stitch.h"

#include <cmath>
#include <limits>
#include <unordered_map>

#include "edges.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {
namespace {

constexpr double kOfDiagonal = 4e-6;
constexpr double kOfEdge = 0.01;

struct BorderVertex {
  std::uint32_t vertex;
  std::uint32_t medium;
  double shortest_edge;
};

std::vector<BorderVertex> border_vertices(const TriangleSoup& soup,
                                          std::span<const std::uint32_t> medium_of_material) {
  std::unordered_map<std::uint32_t, std::size_t> place;
  std::vector<BorderVertex> border;
  const EdgeTable edges(soup.triangles, soup.vertices.size());
  edges.for_each([&](std::span<const EdgeUse> edge) {
    if (edge.size() != 1) return;
    const glm::uvec3& t = soup.triangles[edge[0].triangle()];
    const std::uint32_t high = edge[0].high;
    // The lower end precedes or follows the higher one, depending on the sense.
    const int at = t.x == high ? 0 : t.y == high ? 1 : 2;
    const std::uint32_t low = t[(at + (edge[0].descending() ? 1 : 2)) % 3];
    const double length = glm::length(soup.vertices[low] - soup.vertices[high]);
    const std::uint32_t medium = medium_of_material[soup.material[edge[0].triangle()]];
    for (const std::uint32_t v : {low, high}) {
      const auto [entry, is_new] = place.try_emplace(v, border.size());
      if (is_new) border.push_back({v, medium, length});
      BorderVertex& b = border[entry->second];
      b.shortest_edge = std::min(b.shortest_edge, length);
    }
  });
  return border;
}

}  // namespace

std::uint64_t stitch_borders(TriangleSoup& soup,
                             std::span<const std::uint32_t> medium_of_material) {
  Box box;
  for (const glm::dvec3& v : soup.vertices) box.include(v);
  const double reach = kOfDiagonal * glm::length(box.size());
  const std::vector<BorderVertex> border = border_vertices(soup, medium_of_material);
  if (border.empty() || !(reach > 0.0)) return 0;

  // Cells of twice the reach: whoever lies within reach is in one of the eight cells around the nearest
  // corner. At most 2¹⁸ cells along a side, so three of their numbers fit 64 bits.
  const auto cell_of = [&](const glm::dvec3& p) {
    return glm::floor((p - box.min) / (2.0 * reach));
  };
  const auto key_of = [](const glm::dvec3& cell) {
    const auto bits = [](double c) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(c) + 1);
    };
    return bits(cell.x) << 42 | bits(cell.y) << 21 | bits(cell.z);
  };
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells;
  std::vector<std::uint32_t> target(soup.vertices.size());
  std::iota(target.begin(), target.end(), std::uint32_t{0});
  std::uint64_t n_joined = 0;
  for (std::uint32_t n = 0; n < border.size(); ++n) {
    const BorderVertex& b = border[n];
    const glm::dvec3 p = soup.vertices[b.vertex];
    const glm::dvec3 corner = cell_of(p - reach);
    double nearest = std::numeric_limits<double>::infinity();
    for (int near = 0; near < 8; ++near) {
      const auto cell = cells.find(key_of(corner + glm::dvec3(near & 1, near >> 1 & 1, near >> 2)));
      if (cell == cells.end()) continue;
      for (const std::uint32_t other : cell->second) {
        const BorderVertex& o = border[other];
        const double distance = glm::length(soup.vertices[o.vertex] - p);
        const double allowed =
            std::min(reach, kOfEdge * std::min(b.shortest_edge, o.shortest_edge));
        if (o.medium != b.medium || distance > allowed || distance >= nearest) continue;
        nearest = distance;
        target[b.vertex] = o.vertex;
      }
    }
    if (target[b.vertex] == b.vertex) {
      cells[key_of(cell_of(p))].push_back(n);
    } else {
      ++n_joined;
    }
  }
  if (n_joined == 0) return 0;
  for (glm::uvec3& t : soup.triangles) t = {target[t.x], target[t.y], target[t.z]};
  return n_joined;
}

}  // namespace sarnerf
