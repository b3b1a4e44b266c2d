// SPDX-License-Identifier: Apache-2.0
#include "vdb_file.h"

#include <cstring>

#include "byte_cursor.h"
#include "text.h"

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
  // In between, the offset of the values, which grids without a tree of their own leave empty.
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
    throw InputError(name + ": expected an OpenVDB file, found one that does not begin as they do");
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
    // Each description stands in front of its grid.
    const std::size_t end = file.grids.back().end;
    if (end < cursor.position()) cursor.fail("grids that overlap");
    cursor.skip(end - cursor.position());
  }
  return file;
}

}  // namespace sarnerf
