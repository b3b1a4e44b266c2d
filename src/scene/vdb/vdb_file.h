// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "sarnerf/core/error.h"

namespace sarnerf {

/// Reads a binary file from memory, in the machine's byte order (little-endian, as OpenVDB writes).
/// Nothing is read beyond the end: every call throws InputError instead.
class ByteCursor {
 public:
  /// Bytes [begin, end) of the file. `file` is its name in messages; both must outlive the cursor.
  ByteCursor(std::string_view bytes, const std::string& file, std::size_t begin, std::size_t end)
      : bytes_(bytes.substr(0, end)), file_(file), at_(begin) {}

  std::size_t position() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

  std::string_view take(std::uint64_t n) {
    if (n > left()) {
      fail("the " + std::to_string(n) + " bytes that should follow reach beyond byte " +
           std::to_string(bytes_.size()));
    }
    const std::string_view found = bytes_.substr(at_, static_cast<std::size_t>(n));
    at_ += static_cast<std::size_t>(n);
    return found;
  }
  void skip(std::uint64_t n) { (void)take(n); }

  template <class T>
  T read() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }

  /// Reads a 32-bit length and that many characters.
  std::string_view text() { return take(read<std::uint32_t>()); }

  /// Throws InputError: the file is damaged at this position.
  [[noreturn]] void fail(const std::string& found) const {
    throw InputError(file_ + ": expected a complete OpenVDB file, found damage at byte " +
                     std::to_string(at_) + ": " + found + "; copy or write the file again");
  }

 private:
  std::string_view bytes_;
  const std::string& file_;
  std::size_t at_;
};

}  // namespace sarnerf

/// The outer structure of an OpenVDB file, read without OpenVDB, whose own reader trusts every length in the
/// file. Supports format versions 222 (OpenVDB 2) to 224 (OpenVDB 10).
namespace sarnerf {

struct VdbMetaValue {
  std::string type;        ///< "string", "int32", "float", …
  std::string_view bytes;  ///< within the file
};
using VdbFileMetadata = std::map<std::string, VdbMetaValue>;

/// The value of a text entry; nullopt if there is none or it has another type.
std::optional<std::string> text_entry(const VdbFileMetadata& metadata, const std::string& name);
/// The same for whole numbers.
std::optional<std::int64_t> integer_entry(const VdbFileMetadata& metadata, const std::string& name);
/// The same for three doubles.
std::optional<std::array<double, 3>> vector_entry(const VdbFileMetadata& metadata, const std::string& name);
/// A number, a truth value or text, as text; nullopt for other types.
std::optional<std::string> entry_as_text(const VdbMetaValue& value);

/// A grid's description and position in the file.
struct VdbFileGrid {
  std::string name;             ///< as shown to users
  std::string unique_name;      ///< as used by `instance_parent` of other grids
  std::string type;             ///< of the tree: "Tree_float_5_4_3"
  std::string instance_parent;  ///< the grid that holds this one's tree; usually empty
  bool half = false;            ///< numbers are stored with 16 bits
  std::uint32_t compression = 0;
  VdbFileMetadata metadata;
  std::size_t transform_begin = 0;  ///< then topology and values follow, up to `end`
  std::size_t end = 0;

  /// "fog volume", "level set", …; "unknown" if the grid does not state its class.
  std::string grid_class() const;
};

struct VdbFile {
  std::string name;  ///< in messages
  std::string_view bytes;
  std::uint32_t format_version = 0;
  std::uint32_t library_major = 0, library_minor = 0;
  VdbFileMetadata metadata;
  std::vector<VdbFileGrid> grids;
};

/// Finds all grids. `bytes` must outlive the result. Throws InputError for a file that is not an OpenVDB file, is
/// damaged, has an unsupported version, or was written without offsets to its grids.
VdbFile scan_vdb_file(std::string_view bytes, const std::string& name);

/// Size of a tree.
struct VdbTreeSize {
  std::uint64_t n_leaves = 0;
  std::uint64_t memory_bytes = 0;  ///< once it is loaded
};

/// Checks a grid's tree from the byte after its transform to its end, so that every length is as OpenVDB's reader
/// expects it. A value has `n_components` numbers of 4 bytes each, or 2 if the grid is stored as half floats.
/// Throws InputError at the first mismatch. Cost: a pass over masks and lengths, not over values.
VdbTreeSize check_vdb_tree(const VdbFile& file, const VdbFileGrid& grid, std::size_t topology_begin,
                           int n_components);

}  // namespace sarnerf
