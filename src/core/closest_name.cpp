// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/closest_name.h"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <vector>

namespace sarnerf {
namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Insertions, deletions and replacements that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string closest_name(std::string_view name, std::span<const std::string> names) {
  // Two in five letters wrong is a different word.
  constexpr std::size_t kLongest = 64;
  if (name.size() > kLongest) return {};
  std::size_t fewest = name.size() * 2 / 5 + 1;
  std::string closest;
  for (const std::string& candidate : names) {
    if (candidate.size() > kLongest) continue;
    // A name cut short is as good as one wrong letter.
    const bool begins = name.size() > 2 && candidate.starts_with(name);
    const std::size_t distance = begins ? 1 : edit_distance(name, candidate);
    if (distance < fewest) {
      fewest = distance;
      closest = candidate;
    }
  }
  return closest;
}

}  // namespace sarnerf
