// SPDX-License-Identifier: Apache-2.0
#include "weld.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <set>

namespace sarnerf {
namespace {

constexpr std::uint32_t kFree = std::numeric_limits<std::uint32_t>::max();

std::uint64_t mix(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9e3779b97f4a7c15ull;
  return hash ^ (hash >> 32);
}

std::uint64_t hash_of(const glm::dvec3& p, std::uint32_t medium) {
  // Adding zero turns -0 into 0, which compare equal.
  std::uint64_t hash = mix(medium, std::bit_cast<std::uint64_t>(p.x + 0.0));
  hash = mix(hash, std::bit_cast<std::uint64_t>(p.y + 0.0));
  return mix(hash, std::bit_cast<std::uint64_t>(p.z + 0.0));
}

}  // namespace

std::uint64_t weld_vertices(TriangleSoup& soup, std::span<const std::uint32_t> medium_of_material) {
  // Open addressing, at most half full, or searches would not end: at most one entry per vertex and medium.
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

}  // namespace sarnerf
