// SPDX-License-Identifier: Apache-2.0
// Own OBJ reader, because tinyobjloader 2.0 silently turns vertices that are NaN, infinite or not numbers into
// zeros, keeps no line numbers, and rounds the last digits of coordinates of millions of metres.
// Own OFF reader, because CGAL's writes to the standard error and allocates what the header asks for.
#include <algorithm>
#include <cmath>

#include "readers/readers.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

/// Statements, one per line unless a backslash continues it.
class Statements {
 public:
  explicit Statements(std::string_view text) : cursor_(text) {}

  bool next(std::string_view& statement) {
    if (!cursor_.next_line(statement)) return false;
    line_ = cursor_.line_number();
    if (statement.empty() || statement.back() != '\\') return true;
    joined_.clear();
    std::string_view part = statement;
    while (!part.empty() && part.back() == '\\') {
      joined_.append(part.substr(0, part.size() - 1)).append(" ");
      if (!cursor_.next_line(part)) part = {};
    }
    joined_.append(part);
    statement = joined_;
    return true;
  }
  std::uint64_t line() const { return line_; }
  std::size_t position() const { return cursor_.position(); }

 private:
  TextCursor cursor_;
  std::string joined_;
  std::uint64_t line_ = 0;
};

struct Counts {
  std::uint64_t vertices = 0, triangles = 0;
};

Counts count(std::string_view text) {
  Counts counts;
  Statements statements(text);
  for (std::string_view rest; statements.next(rest);) {
    const std::string_view keyword = take_token(rest);
    if (keyword == "v") ++counts.vertices;
    if (keyword != "f") continue;
    std::uint64_t corners = 0;
    while (!take_token(rest).empty()) ++corners;
    counts.triangles += corners > 2 ? corners - 2 : 0;
  }
  return counts;
}

void read_vertices(const MeshSource& source, ReadProgress& progress, TriangleSoup& soup) {
  Statements statements(source.bytes);
  for (std::string_view rest; statements.next(rest);) {
    progress.at(statements.position() / 2);
    if (take_token(rest) != "v") continue;
    glm::dvec3 vertex;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view token = take_token(rest);
      const std::optional<double> value = parse_real(token);
      if (!value) {
        fail_at_line(source, statements.line(),
                     "expected three coordinates after 'v', found " +
                         (token.empty() ? "the end of the line" : in_quotes(token)));
      }
      vertex[axis] = *value;
    }
    if (!is_finite(vertex)) fail_at_line(source, statements.line(), not_finite(vertex));
    soup.vertices.push_back(vertex);
  }
}

/// Index of a vertex from "7", "7/1", "7//3" or "7/1/3"; negative numbers count back from the last vertex
/// before the face.
std::uint32_t vertex_index(const MeshSource& source, std::uint64_t line, std::string_view token,
                           std::uint64_t n_so_far, std::uint64_t n_vertices) {
  const std::optional<std::int64_t> number = parse_integer(token.substr(0, token.find('/')));
  if (!number) fail_at_line(source, line, "expected a vertex index, found " + in_quotes(token));
  const std::int64_t index =
      *number < 0 ? static_cast<std::int64_t>(n_so_far) + *number : *number - 1;
  if (*number == 0 || index < 0 || static_cast<std::uint64_t>(index) >= n_vertices) {
    fail_at_line(source, line,
                 "the face names vertex " + std::to_string(*number) +
                     ", but the file has vertices 1 to " + std::to_string(n_vertices) +
                     (*number < 0 ? ", " + std::to_string(n_so_far) + " of them before it" : "") +
                     "; the file is damaged or cut off");
  }
  return static_cast<std::uint32_t>(index);
}

/// The rest of a line as one name, without leading and trailing blanks.
std::string_view name_in(std::string_view rest) {
  const std::size_t begin = rest.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return rest.substr(begin, rest.find_last_not_of(" \t") + 1 - begin);
}

void read_faces(const MeshSource& source, ReadProgress& progress, TriangleSoup& soup) {
  PolygonCutter cutter(soup);
  std::vector<std::uint32_t> corners;
  std::uint64_t n_so_far = 0;
  std::string object;
  std::uint32_t material = soup.materials.index(""), group = soup.groups.index("");

  Statements statements(source.bytes);
  for (std::string_view rest; statements.next(rest);) {
    progress.at(source.bytes.size() / 2 + statements.position() / 2);
    const std::string_view keyword = take_token(rest);
    if (keyword == "v") {
      ++n_so_far;
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view token = take_token(rest); !token.empty(); token = take_token(rest)) {
        if (token.front() == '#') break;
        corners.push_back(
            vertex_index(source, statements.line(), token, n_so_far, soup.vertices.size()));
      }
      if (corners.size() > kMaxCorners) {
        fail_at_line(source, statements.line(),
                     "a face of " + with_thousands(corners.size()) + " corners, at most " +
                         with_thousands(kMaxCorners) + " are cut; triangulate the mesh first");
      }
      cutter.add(corners, material, group);
    } else if (keyword == "usemtl") {
      material = soup.materials.index(name_in(rest));
    } else if (keyword == "o") {
      object = name_in(rest);
      group = soup.groups.index(object);
    } else if (keyword == "g") {
      const std::string_view name = name_in(rest);
      group = soup.groups.index(name.empty() ? object : name);
    }
  }
}

}  // namespace

TriangleSoup read_obj(const MeshSource& file) {
  const MeshSource source = text_source(file);
  const Counts counts = count(source.bytes);
  require_countable(source, counts.vertices);
  source.budget.require_mesh(counts.vertices, counts.triangles, source.name);

  TriangleSoup soup;
  soup.reserve(counts.vertices, counts.triangles);
  ReadProgress progress(source);
  read_vertices(source, progress, soup);
  read_faces(source, progress, soup);
  return with_triangles(source, std::move(soup));
}

namespace {

/// Lines with content other than a comment.
class Lines {
 public:
  explicit Lines(const MeshSource& source) : source_(source), cursor_(source.bytes) {}

  /// The next such line, without its comment; throws at the end of the file.
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

/// Throws InputError unless `count` lines of `bytes_each` bytes fit: "0 0 0\n" for a vertex, "1 0\n" for a face.
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
