// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>
#include <set>
#include <tuple>

#include "byte_cursor.h"
#include "text.h"
#include "vdb_file.h"

namespace sarnerf {
namespace {

constexpr std::uint32_t kZip = 1, kActiveMask = 2, kBlosc = 4;
constexpr std::size_t kBloscHeader = 16;

/// What a compressed node says about values that its mask leaves out.
enum NodeKind : std::uint8_t {
  kOneInactive = 2, kMask = 3, kMaskOneInactive = 4, kMaskTwoInactive = 5, kAllValues = 6
};

/// The levels of a standard tree, as log2 of the children along a side.
constexpr int kUpper = 5, kLower = 4, kLeaf = 3;
constexpr std::int32_t kRootStep = 4096;

class TreeWalk {
 public:
  TreeWalk(const VdbFile& file, const VdbFileGrid& grid, std::size_t begin, int n_components)
      : cursor_(file.bytes, file.name, begin, grid.end),
        grid_(grid),
        value_bytes_(4u * static_cast<unsigned>(n_components)),
        packed_bytes_((grid.half ? 2u : 4u) * static_cast<unsigned>(n_components)) {}

  VdbTreeSize walk() {
    if (cursor_.read<std::int32_t>() != 1) cursor_.fail("a tree without its one buffer");
    root();
    for (std::uint64_t n = 0; n < size_.n_leaves; ++n) {
      const std::string_view mask = cursor_.take(mask_bytes(kLeaf));
      values(mask, kLeaf);
    }
    if (cursor_.left() != 0) {
      cursor_.fail(std::to_string(cursor_.left()) + " bytes behind the values of grid " +
                   in_quotes(grid_.name));
    }
    return size_;
  }

 private:
  static constexpr std::size_t mask_bytes(int log2_side) {
    return (std::size_t{1} << (3 * log2_side)) / 8;
  }

  static std::size_t count(std::string_view mask) {
    std::size_t n = 0;
    for (std::size_t at = 0; at < mask.size(); at += 8) {
      std::uint64_t word;
      std::memcpy(&word, mask.data() + at, sizeof word);
      n += static_cast<std::size_t>(std::popcount(word));
    }
    return n;
  }

  void root() {
    cursor_.skip(value_bytes_);  // background
    const auto n_tiles = cursor_.read<std::uint32_t>();
    const auto n_children = cursor_.read<std::uint32_t>();
    size_.memory_bytes += 256;
    for (std::uint32_t n = 0; n < n_tiles; ++n) {
      root_coordinate();
      cursor_.skip(value_bytes_);
      if (cursor_.read<std::uint8_t>() > 1) cursor_.fail("a tile neither active nor inactive");
      size_.memory_bytes += 96;
    }
    for (std::uint32_t n = 0; n < n_children; ++n) {
      root_coordinate();
      upper_node();
    }
  }

  void root_coordinate() {
    const auto x = cursor_.read<std::int32_t>();
    const auto y = cursor_.read<std::int32_t>();
    const auto z = cursor_.read<std::int32_t>();
    if (x % kRootStep != 0 || y % kRootStep != 0 || z % kRootStep != 0) {
      cursor_.fail("a node off the lattice of grid " + in_quotes(grid_.name));
    }
    if (!roots_.emplace(x, y, z).second) cursor_.fail("two nodes at one place");
  }

  std::size_t inner_node(int log2_side) {
    const std::string_view children = cursor_.take(mask_bytes(log2_side));
    const std::string_view active = cursor_.take(mask_bytes(log2_side));
    for (std::size_t n = 0; n < children.size(); ++n) {
      if ((children[n] & active[n]) != 0) cursor_.fail("a node that is a tile, too");
    }
    values(active, log2_side);
    const std::size_t slot_bytes = value_bytes_ > 8 ? 16 : 8;
    size_.memory_bytes += 8 * mask_bytes(log2_side) * slot_bytes + 2 * mask_bytes(log2_side) + 64;
    return count(children);
  }

  void upper_node() {
    for (std::size_t n = inner_node(kUpper); n > 0; --n) lower_node();
  }

  void lower_node() {
    const std::size_t n_leaves = inner_node(kLower);
    cursor_.skip(n_leaves * mask_bytes(kLeaf));
    size_.n_leaves += n_leaves;
    size_.memory_bytes += n_leaves * (8 * mask_bytes(kLeaf) * value_bytes_ + mask_bytes(kLeaf) + 64);
  }

  /// Values of a node with so many children or voxels along a side, of which `active` are active.
  void values(std::string_view active, int log2_side) {
    const auto kind = cursor_.read<std::uint8_t>();
    if (kind > kAllValues) cursor_.fail("a node of unknown kind " + std::to_string(kind));
    if (kind == kOneInactive || kind == kMaskOneInactive) cursor_.skip(value_bytes_);
    if (kind == kMaskTwoInactive) cursor_.skip(2 * value_bytes_);
    if (kind >= kMask && kind <= kMaskTwoInactive) cursor_.skip(mask_bytes(log2_side));
    std::size_t n_stored = 8 * active.size();
    if ((grid_.compression & kActiveMask) != 0 && kind != kAllValues) n_stored = count(active);
    if (n_stored == 0 && grid_.half) return;
    packed(n_stored * packed_bytes_);
  }

  void packed(std::size_t n_bytes) {
    if ((grid_.compression & (kZip | kBlosc)) == 0) return cursor_.skip(n_bytes);
    const auto stored = cursor_.read<std::int64_t>();
    if (stored <= 0) {  // not compressed: the length with a minus
      if (stored != -static_cast<std::int64_t>(n_bytes)) {
        cursor_.fail(std::to_string(stored) + " bytes of values instead of " + std::to_string(n_bytes));
      }
      return cursor_.skip(n_bytes);
    }
    const std::string_view block = cursor_.take(static_cast<std::uint64_t>(stored));
    if ((grid_.compression & kBlosc) == 0) return;
    // Blosc believes its own header, so that this must agree with ours.
    std::uint32_t sizes[3] = {0, 0, 0};  // unpacked, block, packed
    if (block.size() >= kBloscHeader) std::memcpy(sizes, block.data() + 4, sizeof sizes);
    if (sizes[0] != n_bytes || sizes[2] != block.size()) {
      cursor_.fail("a compressed block of other size than its node");
    }
  }

  ByteCursor cursor_;
  const VdbFileGrid& grid_;
  std::size_t value_bytes_, packed_bytes_;
  std::set<std::tuple<std::int32_t, std::int32_t, std::int32_t>> roots_;
  VdbTreeSize size_;
};

}  // namespace

VdbTreeSize check_vdb_tree(const VdbFile& file, const VdbFileGrid& grid, std::size_t topology_begin,
                           int n_components) {
  return TreeWalk(file, grid, topology_begin, n_components).walk();
}

}  // namespace sarnerf
