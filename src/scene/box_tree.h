// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/geometry/box.h"

namespace sarnerf {

inline bool encloses(const Box& outer, const Box& inner) {
  return glm::all(glm::lessThanEqual(outer.min, inner.min)) && glm::all(glm::greaterThanEqual(outer.max, inner.max));
}

/// Finds which of many boxes enclose another: logarithmic in their number where they do not all overlap.
class BoxTree {
 public:
  explicit BoxTree(std::span<const Box> boxes);

  /// Numbers of the boxes that enclose `inner`, ascending; replaces `found`.
  void enclosing(const Box& inner, std::vector<std::uint32_t>& found) const;

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  ///< of order_ in a leaf; count 0: `first` is the second child
  };

  std::uint32_t build(std::uint32_t first, std::uint32_t count);

  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;  ///< a node's first child follows it
};

}  // namespace sarnerf
