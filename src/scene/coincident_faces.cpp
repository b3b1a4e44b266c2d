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
  std::uint32_t triangle;
  bool odd;  ///< sense, relative to the sorted corners
};

FaceKey key_of(const glm::uvec3& v, std::uint32_t triangle) {
  FaceKey key{{v.x, v.y, v.z}, triangle, false};
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
/// between two solids leaves the two solids' own faces all along its border, a sheet leaves none.
class OpposedPairs {
 public:
  OpposedPairs(std::span<const glm::uvec3> triangles, const std::vector<bool>& keep,
               const std::vector<std::uint32_t>& kept_of_pair)
      : regions_(kept_of_pair.size()), is_wall_(kept_of_pair.size(), true) {
    std::vector<std::uint32_t> pair_of(triangles.size(), kNone);
    for (std::uint32_t p = 0; p < kept_of_pair.size(); ++p) pair_of[kept_of_pair[p]] = p;

    std::vector<std::uint32_t> border_pairs;
    const EdgeTable edges(triangles);
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
      if (n_pairs > 0 && n_others != (n_pairs == 1 ? 2u : 0u)) border_pairs.push_back(first_pair);
    });
    for (const std::uint32_t pair : border_pairs) is_wall_[regions_.root(pair)] = false;
  }

  bool is_wall(std::uint32_t pair) { return is_wall_[regions_.root(pair)]; }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  Components regions_;
  std::vector<bool> is_wall_;
};

}  // namespace

void drop_coincident_faces(TriangleSoup& soup, RepairCounts& counts) {
  std::vector<FaceKey> keys;
  keys.reserve(soup.triangles.size());
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    keys.push_back(key_of(soup.triangles[t], t));
  }
  std::sort(keys.begin(), keys.end(), [](const FaceKey& a, const FaceKey& b) {
    return a.sorted != b.sorted ? a.sorted < b.sorted : a.triangle < b.triangle;
  });

  std::vector<bool> keep(soup.triangles.size(), true);
  std::vector<std::uint32_t> kept_of_pair;
  for (std::size_t begin = 0, end; begin < keys.size(); begin = end) {
    bool opposed = false;
    for (end = begin + 1; end < keys.size() && keys[end].sorted == keys[begin].sorted; ++end) {
      opposed |= keys[end].odd != keys[begin].odd;
      keep[keys[end].triangle] = false;
      ++counts.duplicate_faces;
    }
    if (opposed) kept_of_pair.push_back(keys[begin].triangle);
  }
  if (counts.duplicate_faces == 0) return;
  keys = {};

  if (!kept_of_pair.empty()) {
    OpposedPairs pairs(soup.triangles, keep, kept_of_pair);
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
