// SPDX-License-Identifier: Apache-2.0
// Own reader, because CGAL's writes to the standard error and allocates what the header asks for.
#include <algorithm>

#include "reader_common.h"
#include "text.h"
#include "text_cursor.h"

namespace sarnerf {
namespace {

/// Lines that hold something besides a comment.
class Lines {
 public:
  explicit Lines(const MeshSource& source) : source_(source), cursor_(source.bytes) {}

  /// The next such line, cut at its comment; throws at the end of the file.
  std::string_view next(const std::string& expected) {
    std::string_view line;
    while (cursor_.next_line(line)) {
      line = line.substr(0, line.find('#'));
      if (line.find_first_not_of(" \t") != std::string_view::npos) return line;
    }
    fail(source_, "expected " + expected + ", found the end of the file; it is cut off or damaged");
  }
  std::uint64_t number() const { return cursor_.line_number(); }
  std::size_t position() const { return cursor_.position(); }
  std::size_t remaining() const { return cursor_.remaining(); }

 private:
  const MeshSource& source_;
  TextCursor cursor_;
};

std::uint64_t take_count(const MeshSource& source, const Lines& lines, std::string_view& rest,
                         const char* what) {
  const std::string_view token = take_token(rest);
  const std::optional<std::int64_t> count = parse_integer(token);
  if (!count || *count < 0) {
    fail_at_line(source, lines.number(),
                 std::string("expected the number of ") + what + ", found " + in_quotes(token));
  }
  return static_cast<std::uint64_t>(*count);
}

/// Each vertex takes at least "0 0 0\n" and each face "3 0 1 2\n".
void require_room(const MeshSource& source, std::uint64_t count, std::uint64_t bytes_each,
                  std::uint64_t remaining, const char* what) {
  if (count > (remaining + 1) / bytes_each) {
    fail(source, "the header promises " + counted(count, what, (std::string(what) + "s").c_str()) +
                     ", but only " + counted(remaining, "byte is", "bytes are") +
                     " left; the file is cut off or damaged");
  }
}

}  // namespace

TriangleSoup read_off(const MeshSource& file) {
  const MeshSource source = text_source(file);
  Lines lines(source);
  std::string_view rest = lines.next("the word OFF");
  const std::string_view first = take_token(rest);
  constexpr std::string_view kEnding = "OFF";
  const bool known = first.size() >= kEnding.size() &&
                     first.substr(first.size() - kEnding.size()) == kEnding &&
                     first.find_first_not_of("STCNOF") == std::string_view::npos;
  if (!known) {
    fail_at_line(source, lines.number(),
                 "expected OFF, COFF, NOFF or STOFF, found " + in_quotes(first) +
                     "; four-dimensional OFF is not read");
  }
  if (rest.find("BINARY") != std::string_view::npos) {
    fail(source, "binary OFF is not read; convert it to ASCII OFF or to PLY");
  }
  if (rest.find_first_not_of(" \t") == std::string_view::npos) rest = lines.next("the counts");
  const std::uint64_t n_vertices = take_count(source, lines, rest, "vertices");
  const std::uint64_t n_faces = take_count(source, lines, rest, "faces");
  require_countable(source, n_vertices);
  require_room(source, n_vertices, 6, lines.remaining(), "vertex line");
  require_room(source, n_faces, 4, lines.remaining(), "face line");
  source.budget.require_mesh(n_vertices, n_faces, source.name);

  TriangleSoup soup;
  soup.reserve(n_vertices, n_faces);
  ReadProgress progress(source);
  for (std::uint64_t n = 0; n < n_vertices; ++n) {
    rest = lines.next("vertex " + std::to_string(n) + " of " + std::to_string(n_vertices));
    progress.at(lines.position());
    glm::dvec3 vertex;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view token = take_token(rest);
      const std::optional<double> value = parse_real(token);
      if (!value) {
        fail_at_line(source, lines.number(),
                     "expected three coordinates, found " + in_quotes(token));
      }
      vertex[axis] = *value;
    }
    if (!is_finite(vertex)) fail_at_line(source, lines.number(), not_finite(vertex));
    soup.vertices.push_back(vertex);
  }

  PolygonCutter cutter(soup);
  const std::uint32_t material = soup.materials.index(""), group = soup.groups.index("");
  std::vector<std::uint32_t> corners;
  for (std::uint64_t n = 0; n < n_faces; ++n) {
    rest = lines.next("face " + std::to_string(n) + " of " + std::to_string(n_faces));
    progress.at(lines.position());
    const std::uint64_t n_corners = take_count(source, lines, rest, "corners");
    if (n_corners > kMaxCorners) {
      fail_at_line(source, lines.number(),
                   "a face of " + with_thousands(n_corners) + " corners, at most " +
                       with_thousands(kMaxCorners) + " are cut; triangulate the mesh first");
    }
    corners.clear();
    for (std::uint64_t c = 0; c < n_corners; ++c) {
      const std::string_view token = take_token(rest);
      const std::optional<std::int64_t> index = parse_integer(token);
      if (!index) {
        fail_at_line(source, lines.number(),
                     "expected " + counted(n_corners, "vertex index", "vertex indices") +
                         ", found " + (token.empty() ? "the end of the line" : in_quotes(token)));
      }
      if (*index < 0 || static_cast<std::uint64_t>(*index) >= n_vertices) {
        fail_at_line(source, lines.number(),
                     "the face names vertex " + std::to_string(*index) +
                         ", but the file has vertices 0 to " + std::to_string(n_vertices - 1) +
                         "; the file is damaged");
      }
      corners.push_back(static_cast<std::uint32_t>(*index));
    }
    cutter.add(corners, material, group);
  }
  return with_triangles(source, std::move(soup));
}

}  // namespace sarnerf
