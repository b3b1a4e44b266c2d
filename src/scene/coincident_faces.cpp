// SPDX-License-Identifier: Apache-2.0
#include "coincident_faces.h"

#include <algorithm>
#include <array>

#include "edges.h"
#include "weld.h"

namespace sarnerf {
namespace {

struct FaceKey {
  std::array<std::uint32_t, 3> sorted;
  bool odd;  ///< sense, relative to the sorted corners
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

/// What remains at the edges of opposed pairs when both faces of each pair are gone decides: a wall
/// between two solids leaves the two solids' own faces all along its border, a sheet leaves none, and a
/// solid whose faces are all drawn from both sides has no border.
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
