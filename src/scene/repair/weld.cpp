// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>

#include "repair/mesh_edges.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

namespace {

constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

std::uint64_t mix(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9e3779b97f4a7c15ull;
  return hash ^ (hash >> 32);
}

std::uint64_t hash_of(const glm::dvec3& p, std::uint32_t medium) {
  // Adding zero turns -0 into 0; the two compare equal.
  std::uint64_t hash = mix(medium, std::bit_cast<std::uint64_t>(p.x + 0.0));
  hash = mix(hash, std::bit_cast<std::uint64_t>(p.y + 0.0));
  return mix(hash, std::bit_cast<std::uint64_t>(p.z + 0.0));
}

}  // namespace

std::uint64_t weld_vertices(TriangleSoup& soup, std::span<const std::uint32_t> medium_of_material) {
  // Open addressing. The table is at most half full, because searches in a full one would not end. It has at most
  // one entry per vertex and medium.
  std::size_t n_slots = 16;
  const std::size_t n_media = std::set(medium_of_material.begin(), medium_of_material.end()).size();
  const std::size_t most = std::min(soup.vertices.size() * n_media, soup.triangles.size() * 3);
  while (n_slots < 2 * most) n_slots *= 2;
  std::vector<std::uint32_t> slots(n_slots, kFree);
  std::vector<glm::dvec3> welded;
  std::vector<std::uint32_t> medium_of_welded;
  std::vector<bool> used(soup.vertices.size(), false);
  welded.reserve(soup.vertices.size() / 2);
  std::uint64_t n_used = 0;

  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const std::uint32_t medium = medium_of_material[soup.material[t]];
    for (int c = 0; c < 3; ++c) {
      std::uint32_t& corner = soup.triangles[t][c];
      if (!used[corner]) {
        used[corner] = true;
        ++n_used;
      }
      const glm::dvec3 p = soup.vertices[corner];
      std::size_t slot = hash_of(p, medium) & (n_slots - 1);
      while (slots[slot] != kFree &&
             !(welded[slots[slot]] == p && medium_of_welded[slots[slot]] == medium)) {
        slot = (slot + 1) & (n_slots - 1);
      }
      if (slots[slot] == kFree) {
        slots[slot] = static_cast<std::uint32_t>(welded.size());
        welded.push_back(p);
        medium_of_welded.push_back(medium);
      }
      corner = slots[slot];
    }
  }
  soup.vertices = std::move(welded);
  return n_used > soup.vertices.size() ? n_used - soup.vertices.size() : 0;
}

void keep_triangles(TriangleSoup& soup, const std::vector<bool>& keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    if (!keep[t]) continue;
    soup.triangles[kept] = soup.triangles[t];
    soup.material[kept] = soup.material[t];
    soup.group[kept] = soup.group[t];
    ++kept;
  }
  soup.triangles.resize(kept);
  soup.material.resize(kept);
  soup.group.resize(kept);
}

std::uint64_t drop_repeated_corners(TriangleSoup& soup) {
  std::vector<bool> keep(soup.triangles.size());
  std::uint64_t n_dropped = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const glm::uvec3& v = soup.triangles[t];
    keep[t] = v.x != v.y && v.y != v.z && v.z != v.x;
    n_dropped += keep[t] ? 0 : 1;
  }
  if (n_dropped > 0) keep_triangles(soup, keep);
  return n_dropped;
}

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
    // The lower end precedes or follows the higher one, depending on the side's direction.
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

  // Cells of twice the reach: all vertices within reach lie in the eight cells around the nearest cell corner.
  // There are at most 2¹⁸ cells along a side, so three cell indices fit into 64 bits.
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

namespace {

struct FaceKey {
  std::array<std::uint32_t, 3> sorted;
  bool odd;  ///< the corners are an odd permutation of the sorted ones
};

FaceKey key_of(const glm::uvec3& v) {
  FaceKey key{{v.x, v.y, v.z}, false};
  const auto order = [&](std::size_t a, std::size_t b) {
    if (key.sorted[a] <= key.sorted[b]) return;
    std::swap(key.sorted[a], key.sorted[b]);
    key.odd = !key.odd;
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return key;
}

/// Distinguishes walls from sheets in regions of opposed pairs, by the faces that remain at a region's edges when
/// both faces of each pair are removed. At the border of a wall between two solids, the two solids' own faces
/// remain all along; at a sheet no face remains; a solid whose faces are all drawn from both sides has no border.
class OpposedPairs {
 public:
  OpposedPairs(std::span<const glm::uvec3> triangles, std::size_t n_vertices,
               const std::vector<bool>& keep, const std::vector<std::uint32_t>& kept_of_pair)
      : regions_(kept_of_pair.size()),
        has_border_(kept_of_pair.size(), false),
        is_wall_(kept_of_pair.size(), true) {
    std::vector<std::uint32_t> pair_of(triangles.size(), kNone);
    for (std::uint32_t p = 0; p < kept_of_pair.size(); ++p) pair_of[kept_of_pair[p]] = p;

    std::vector<std::uint32_t> border_pairs, sheet_pairs;
    const EdgeTable edges(triangles, n_vertices);
    edges.for_each([&](std::span<const EdgeUse> edge) {
      std::size_t n_others = 0, n_pairs = 0;
      std::uint32_t first_pair = kNone;
      for (const EdgeUse& use : edge) {
        const std::uint32_t pair = pair_of[use.triangle()];
        if (pair == kNone) {
          n_others += keep[use.triangle()] ? 1 : 0;
        } else {
          if (n_pairs++ == 0) first_pair = pair;
          regions_.join(first_pair, pair);
        }
      }
      if (n_pairs == 1) border_pairs.push_back(first_pair);
      if (n_pairs > 0 && n_others != (n_pairs == 1 ? 2u : 0u)) sheet_pairs.push_back(first_pair);
    });
    for (const std::uint32_t pair : border_pairs) has_border_[regions_.root(pair)] = true;
    for (const std::uint32_t pair : sheet_pairs) is_wall_[regions_.root(pair)] = false;
  }

  bool is_wall(std::uint32_t pair) {
    const std::uint32_t region = regions_.root(pair);
    return has_border_[region] && is_wall_[region];
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  Components regions_;
  std::vector<bool> has_border_, is_wall_;
};

}  // namespace

void drop_coincident_faces(TriangleSoup& soup, RepairCounts& counts) {
  const auto key = [&](std::uint32_t t) { return key_of(soup.triangles[t]); };
  std::vector<std::uint32_t> filed(soup.triangles.size());
  const std::vector<std::uint32_t> begin = file_by_vertex(
      soup.vertices.size(), static_cast<std::uint32_t>(filed.size()),
      [&](std::uint32_t t) { return key(t).sorted[0]; },
      [&](std::uint32_t t, std::uint32_t slot) { filed[slot] = t; });

  std::vector<bool> keep(soup.triangles.size(), true);
  std::vector<std::uint32_t> kept_of_pair;
  for (std::size_t v = 0; v + 1 < begin.size(); ++v) {
    std::stable_sort(
        filed.begin() + begin[v], filed.begin() + begin[v + 1],
        [&](std::uint32_t a, std::uint32_t b) { return key(a).sorted < key(b).sorted; });
    for (std::size_t first = begin[v], last; first < begin[v + 1]; first = last) {
      const FaceKey first_key = key(filed[first]);
      bool opposed = false;
      for (last = first + 1; last < begin[v + 1] && key(filed[last]).sorted == first_key.sorted;
           ++last) {
        opposed |= key(filed[last]).odd != first_key.odd;
        keep[filed[last]] = false;
        ++counts.duplicate_faces;
      }
      if (opposed) kept_of_pair.push_back(filed[first]);
    }
  }
  if (counts.duplicate_faces == 0) return;
  filed = {};

  if (!kept_of_pair.empty()) {
    OpposedPairs pairs(soup.triangles, soup.vertices.size(), keep, kept_of_pair);
    for (std::uint32_t p = 0; p < kept_of_pair.size(); ++p) {
      if (!pairs.is_wall(p)) continue;
      keep[kept_of_pair[p]] = false;
      --counts.duplicate_faces;
      counts.interior_faces += 2;
    }
  }
  keep_triangles(soup, keep);
}

}  // namespace sarnerf
