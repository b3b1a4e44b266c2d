// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "triangle_soup.h"

namespace sarnerf {

/// Removes the next run of non-blank characters from the front of `rest` and returns it; empty at the end.
std::string_view take_token(std::string_view& rest);

/// The whole token as a number, independent of the locale. "nan" and "inf" are numbers; values that overflow
/// become infinite, values that underflow become zero.
std::optional<double> parse_real(std::string_view token);

/// The whole token as an integer, with an optional sign.
std::optional<std::int64_t> parse_integer(std::string_view token);

/// Reads a text from front to back and counts its lines for error messages.
class TextCursor {
 public:
  /// Lines end as the first one does: by "\n", with or without "\r" before it, or by "\r" alone, as old
  /// Macintosh programs write them.
  explicit TextCursor(std::string_view text);

  /// Next line without its end; false at the end of the text.
  bool next_line(std::string_view& line);

  /// Next token, on this line or a later one; empty at the end of the text.
  std::string_view next_token();

  std::uint64_t line_number() const { return line_number_; }  ///< of the text returned last; the first line is 1
  std::size_t position() const { return position_; }          ///< bytes read so far
  std::size_t remaining() const { return text_.size() - position_; }

 private:
  std::string_view text_;
  char line_end_;
  std::size_t position_ = 0;
  std::uint64_t line_number_ = 0;
  bool in_line_ = false;  ///< next_token() has read part of the line
};

}  // namespace sarnerf

/// Readers of mesh files. They work on bytes in memory, so that files, tests and fuzzers use the same code.
/// No reader trusts a count: the header's counts are compared with the bytes that are left before anything
/// is allocated. All throw InputError with name, line or face, what was expected and what was found;
/// UsageError when the mesh does not fit the memory budget; Interrupted.
namespace sarnerf {

struct MeshSource {
  std::string_view bytes;
  std::string name;  ///< in messages
  MemoryBudget budget;
  Monitor monitor;
};

/// Wavefront OBJ: v, f, g, o, usemtl. Colours, normals, texture coordinates, .mtl files, lines and points are
/// ignored. The last `g` or `o` names the group; a `g` without a name returns to the name of the last `o`.
TriangleSoup read_obj(const MeshSource& source);

/// PLY 1.0: ASCII and binary of both byte orders, any elements and properties. A scalar face property
/// mat, material, material_id or material_index is the material; its name is the integer as text.
TriangleSoup read_ply(const MeshSource& source);

/// STL, ASCII and binary, distinguished by the length that a binary header states, and only then by the word
/// solid. `solid` names the group.
TriangleSoup read_stl(const MeshSource& source);

/// OFF in ASCII. Colours, normals and texture coordinates after the positions and indices are ignored.
TriangleSoup read_off(const MeshSource& source);

/// Whether read_mesh() has a reader for the file name's ending.
bool is_mesh_file(const std::filesystem::path& path);

/// Chooses the reader by the file name's ending.
TriangleSoup read_mesh(const std::filesystem::path& path, const MeshSource& source);

/// The whole file. Throws InputError for one that is missing, empty, unreadable or not a plain file.
std::string read_file(const std::filesystem::path& path, const MemoryBudget& budget);

/// Throws InputError "name:line: message".
[[noreturn]] void fail_at_line(const MeshSource& source, std::uint64_t line,
                               const std::string& message);

/// Throws InputError "name: message".
[[noreturn]] void fail(const MeshSource& source, const std::string& message);

}  // namespace sarnerf

namespace sarnerf {

/// Reports progress and checks for a stop every 4 MiB; cheap enough to call for every line.
class ReadProgress {
 public:
  explicit ReadProgress(const MeshSource& source) : source_(source) {}
  void at(std::size_t position) {
    if (position < next_) return;
    next_ = position + kStep;
    source_.monitor.check();
    source_.monitor.report("reading", position, source_.bytes.size());
  }

 private:
  static constexpr std::size_t kStep = std::size_t{4} << 20;
  const MeshSource& source_;
  std::size_t next_ = 0;
};

/// The same source without UTF-8's byte-order mark. Throws InputError for UTF-16 and UTF-32.
MeshSource text_source(MeshSource source);

/// Throws unless vertex indices fit 32 bits.
void require_countable(const MeshSource& source, std::uint64_t n_vertices);

/// Returns the soup; throws InputError if it has no triangle, or too many for 32-bit indices of their sides.
TriangleSoup with_triangles(const MeshSource& source, TriangleSoup soup);

/// Message for a vertex that is not finite.
std::string not_finite(const glm::dvec3& vertex);

inline bool is_finite(const glm::dvec3& v) {
  // False for an infinity or a NaN in any coordinate.
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace sarnerf
