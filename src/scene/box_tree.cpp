// SPDX-License-Identifier: Apache-2.0
#include "box_tree.h"

#include <algorithm>
#include <numeric>

namespace sarnerf {
namespace {

constexpr std::uint32_t kLeafBoxes = 4;

}  // namespace

BoxTree::BoxTree(std::span<const Box> boxes) : boxes_(boxes.begin(), boxes.end()), order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!boxes_.empty()) build(0, static_cast<std::uint32_t>(boxes_.size()));
}

std::uint32_t BoxTree::build(std::uint32_t first, std::uint32_t count) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Box box, centres;
  for (std::uint32_t n = first; n < first + count; ++n) {
    box.include(boxes_[order_[n]].min);
    box.include(boxes_[order_[n]].max);
    centres.include(boxes_[order_[n]].centre());
  }
  nodes_[number].box = box;
  if (count <= kLeafBoxes) {
    nodes_[number].first = first;
    nodes_[number].count = count;
    return number;
  }
  // Halves by number along the longest side: as deep as the logarithm, whatever the boxes are.
  const glm::dvec3 size = centres.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + count / 2, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    return boxes_[a].centre()[axis] < boxes_[b].centre()[axis];
  });
  build(first, count / 2);
  const std::uint32_t second = build(first + count / 2, count - count / 2);
  nodes_[number].first = second;
  return number;
}

void BoxTree::enclosing(const Box& inner, std::vector<std::uint32_t>& found) const {
  found.clear();
  std::vector<std::uint32_t> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::uint32_t number = open.back();
    open.pop_back();
    const Node& node = nodes_[number];
    if (!encloses(node.box, inner)) continue;
    if (node.count == 0) {
      open.push_back(number + 1);
      open.push_back(node.first);
      continue;
    }
    for (std::uint32_t n = node.first; n < node.first + node.count; ++n) {
      if (encloses(boxes_[order_[n]], inner)) found.push_back(order_[n]);
    }
  }
  std::sort(found.begin(), found.end());
}

}  // namespace sarnerf
