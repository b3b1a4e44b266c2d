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

/// Takes the next run of characters that are not blank from the front of `rest`; empty at its end.
std::string_view take_token(std::string_view& rest);

/// The whole token as a number, independent of the locale. "nan" and "inf" are numbers; what
/// overflows is infinite, what underflows is zero.
std::optional<double> parse_real(std::string_view token);

/// The whole token as an integer, with an optional sign.
std::optional<std::int64_t> parse_integer(std::string_view token);

/// Walks over a text and knows the line it is in, so that errors can name it.
class TextCursor {
 public:
  /// Lines end as the first one does: by "\n", with or without "\r" before it, or by "\r" alone, as old
  /// Macintosh programs write them.
  explicit TextCursor(std::string_view text);

  /// Next line without its end; false at the end of the text.
  bool next_line(std::string_view& line);

  /// Next token, on this line or a later one; empty at the end of the text.
  std::string_view next_token();

  std::uint64_t line_number() const { return line_number_; }  ///< of what was returned last, from 1
  std::size_t position() const { return position_; }          ///< bytes passed
  std::size_t remaining() const { return text_.size() - position_; }

 private:
  std::string_view text_;
  char line_end_;
  std::size_t position_ = 0;
  std::uint64_t line_number_ = 0;
  bool in_line_ = false;  ///< next_token() has begun the line
};

}  // namespace sarnerf

/// Readers of mesh files. They work on bytes in memory, so that the same code reads files and takes the
/// blows of tests and fuzzers. None trusts a count: what a header promises is compared with the bytes
/// that are left before anything is allocated. All throw InputError with name, line or face, what was
/// expected and what was found; UsageError when the memory budget does not hold the mesh; Interrupted.
namespace sarnerf {

struct MeshSource {
  std::string_view bytes;
  std::string name;  ///< how messages call it
  MemoryBudget budget;
  Monitor monitor;
};

/// Wavefront OBJ: v, f, g, o, usemtl. Colours, normals, texture coordinates, .mtl files, lines and
/// points are passed over. `g` names the group, or `o` where there is no `g`.
TriangleSoup read_obj(const MeshSource& source);

/// PLY 1.0: ASCII and binary of both byte orders, any elements and properties. A scalar face property
/// mat, material, material_id, material_index or mtl is the material; its name is the integer as text.
TriangleSoup read_ply(const MeshSource& source);

/// STL, ASCII and binary, told apart by the length that a binary header promises. `solid` names the
/// group.
TriangleSoup read_stl(const MeshSource& source);

/// OFF in ASCII, with or without colours, normals and texture coordinates behind the numbers that count.
TriangleSoup read_off(const MeshSource& source);

/// Whether read_mesh() knows the file name's ending.
bool is_mesh_file(const std::filesystem::path& path);

/// Picks the reader by the file name's ending.
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

/// Reports progress and honours a stop now and then; cheap enough for every line.
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

/// Throws when a soup holds no triangle; passes it on otherwise.
TriangleSoup with_triangles(const MeshSource& source, TriangleSoup soup);

/// Words for a vertex that is not finite.
std::string not_finite(const glm::dvec3& vertex);

inline bool is_finite(const glm::dvec3& v) {
  // One comparison that fails for infinities and NaN alike, on any coordinate.
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace sarnerf
