// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "readers.h"

namespace sarnerf {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class PlyEncoding { ascii, little_endian, big_endian };

std::size_t byte_size(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;         ///< of the value, or of each value of a list
  std::optional<PlyType> list_count_type;  ///< set for lists

  /// Bytes that it takes in a binary file when its list is empty.
  std::size_t least_bytes() const { return byte_size(list_count_type.value_or(type)); }
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Place of the first property with one of these names.
  template <class... Names>
  std::optional<std::size_t> find(Names... names) const {
    for (std::size_t n = 0; n < properties.size(); ++n) {
      if (((properties[n].name == names) || ...)) return n;
    }
    return std::nullopt;
  }
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;  ///< in the order of the file
  std::size_t body_begin = 0;        ///< first byte behind the header
  std::uint64_t n_lines = 0;         ///< of the header
};

/// Parses "ply … end_header" and checks each count against the bytes that follow.
PlyHeader read_ply_header(const MeshSource& source);

}  // namespace sarnerf
