// SPDX-License-Identifier: Apache-2.0
#include "vdb/vdb_file.h"

#include <bit>
#include <cstring>
#include <set>
#include <tuple>

#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

constexpr std::uint64_t kMagic = 0x56444220;
constexpr std::uint32_t kOldest = 222, kNewest = 224;
constexpr std::size_t kIdentifierBytes = 36;
constexpr std::string_view kHalfSuffix = "_HalfFloat";
constexpr char kNameSeparator = '\x1e';  // between a name and a number that makes it unique

template <class T>
std::optional<T> value_of(const VdbMetaValue& value, std::string_view type) {
  if (value.type != type || value.bytes.size() != sizeof(T)) return std::nullopt;
  T number;
  std::memcpy(&number, value.bytes.data(), sizeof number);
  return number;
}

VdbFileMetadata read_metadata(ByteCursor& cursor) {
  VdbFileMetadata metadata;
  const auto n_entries = cursor.read<std::uint32_t>();
  for (std::uint32_t n = 0; n < n_entries; ++n) {
    std::string name(cursor.text());
    VdbMetaValue value;
    value.type = std::string(cursor.text());
    value.bytes = cursor.text();
    metadata.emplace(std::move(name), std::move(value));
  }
  return metadata;
}

/// An offset within the file that does not lie before `least`.
std::size_t read_offset(ByteCursor& cursor, std::size_t least, std::size_t file_size) {
  const auto offset = cursor.read<std::int64_t>();
  if (offset < static_cast<std::int64_t>(least) || offset > static_cast<std::int64_t>(file_size)) {
    cursor.fail("a grid that lies at byte " + std::to_string(offset) + " of a file of " +
                std::to_string(file_size));
  }
  return static_cast<std::size_t>(offset);
}

VdbFileGrid read_grid(ByteCursor& cursor, const VdbFile& file) {
  VdbFileGrid grid;
  grid.unique_name = std::string(cursor.text());
  grid.name = grid.unique_name.substr(0, grid.unique_name.find(kNameSeparator));
  grid.type = std::string(cursor.text());
  if (grid.type.ends_with(kHalfSuffix)) {
    grid.half = true;
    grid.type.resize(grid.type.size() - kHalfSuffix.size());
  }
  grid.instance_parent = std::string(cursor.text());
  const std::size_t size = file.bytes.size();
  const std::size_t begin = read_offset(cursor, cursor.position(), size);
  // The offset of the values is in between. Grids without a tree of their own leave it empty.
  cursor.skip(sizeof(std::int64_t));
  grid.end = read_offset(cursor, begin, size);

  ByteCursor inside(file.bytes, file.name, begin, grid.end);
  grid.compression = inside.read<std::uint32_t>();
  if (grid.compression > 7) {
    inside.fail("compression flags " + std::to_string(grid.compression) + " of grid " +
                in_quotes(grid.name));
  }
  grid.metadata = read_metadata(inside);
  grid.transform_begin = inside.position();
  return grid;
}

}  // namespace

std::optional<std::string> text_entry(const VdbFileMetadata& metadata, const std::string& name) {
  const auto found = metadata.find(name);
  if (found == metadata.end() || found->second.type != "string") return std::nullopt;
  return std::string(found->second.bytes);
}

std::optional<std::int64_t> integer_entry(const VdbFileMetadata& metadata, const std::string& name) {
  const auto found = metadata.find(name);
  if (found == metadata.end()) return std::nullopt;
  if (const auto n = value_of<std::int32_t>(found->second, "int32")) return *n;
  return value_of<std::int64_t>(found->second, "int64");
}

std::optional<std::array<double, 3>> vector_entry(const VdbFileMetadata& metadata, const std::string& name) {
  const auto found = metadata.find(name);
  if (found == metadata.end()) return std::nullopt;
  return value_of<std::array<double, 3>>(found->second, "vec3d");
}

std::optional<std::string> entry_as_text(const VdbMetaValue& value) {
  if (value.type == "string") return std::string(value.bytes);
  if (const auto n = value_of<std::int32_t>(value, "int32")) return std::to_string(*n);
  if (const auto n = value_of<std::int64_t>(value, "int64")) return std::to_string(*n);
  if (const auto x = value_of<float>(value, "float")) return number_text(double{*x});
  if (const auto x = value_of<double>(value, "double")) return number_text(*x);
  if (const auto b = value_of<char>(value, "bool")) return *b ? "true" : "false";
  return std::nullopt;
}

std::string VdbFileGrid::grid_class() const { return text_entry(metadata, "class").value_or("unknown"); }

VdbFile scan_vdb_file(std::string_view bytes, const std::string& name) {
  VdbFile file;
  file.name = name;
  file.bytes = bytes;
  ByteCursor cursor(bytes, name, 0, bytes.size());
  if (bytes.size() < sizeof kMagic || cursor.read<std::uint64_t>() != kMagic) {
    throw InputError(name + ": expected an OpenVDB file, found a file without OpenVDB's magic number");
  }
  file.format_version = cursor.read<std::uint32_t>();
  if (file.format_version < kOldest || file.format_version > kNewest) {
    throw InputError(name + ": expected an OpenVDB file of format version " + std::to_string(kOldest) +
                     " to " + std::to_string(kNewest) + " (OpenVDB 2 to 10), found version " +
                     std::to_string(file.format_version) + "; convert it with a tool that reads it");
  }
  file.library_major = cursor.read<std::uint32_t>();
  file.library_minor = cursor.read<std::uint32_t>();
  const bool has_offsets = cursor.read<char>() != 0;
  cursor.skip(kIdentifierBytes);
  if (!has_offsets) {
    throw InputError(name + ": expected a file with offsets to its grids, found one that was written as "
                            "a stream; write it with openvdb::io::File");
  }
  file.metadata = read_metadata(cursor);
  const auto n_grids = cursor.read<std::uint32_t>();
  for (std::uint32_t n = 0; n < n_grids; ++n) {
    file.grids.push_back(read_grid(cursor, file));
    // Each description precedes its grid.
    const std::size_t end = file.grids.back().end;
    if (end < cursor.position()) cursor.fail("grids that overlap");
    cursor.skip(end - cursor.position());
  }
  return file;
}

namespace {

constexpr std::uint32_t kZip = 1, kActiveMask = 2, kBlosc = 4;
constexpr std::size_t kBloscHeader = 16;

/// How a compressed node stores the values that its mask leaves out.
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
    if (cursor_.read<std::int32_t>() != 1) cursor_.fail("a tree with a buffer count other than 1");
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

  /// Skips the values of a node with 2^log2_side children or voxels along a side. `active`: mask of active values.
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
    if (stored <= 0) {  // not compressed: the negative length
      if (stored != -static_cast<std::int64_t>(n_bytes)) {
        cursor_.fail(std::to_string(stored) + " bytes of values instead of " + std::to_string(n_bytes));
      }
      return cursor_.skip(n_bytes);
    }
    const std::string_view block = cursor_.take(static_cast<std::uint64_t>(stored));
    if ((grid_.compression & kBlosc) == 0) return;
    // Blosc trusts its own header, so it must agree with the file's.
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
