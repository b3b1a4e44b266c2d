// SPDX-License-Identifier: Apache-2.0
// Own reader, because CGAL's reads a truncated file as a shorter mesh.
#include <algorithm>
#include <bit>

#include "readers/readers.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of comment, then the number of triangles
constexpr std::size_t kFacetBytes = 50;   // normal, three corners, two bytes of any content

/// A little-endian value at any address, on any machine.
std::uint32_t load_u32(const char* bytes) {
  std::uint32_t value = 0;
  for (int n = 3; n >= 0; --n) value = (value << 8) | static_cast<unsigned char>(bytes[n]);
  return value;
}

void add_facet(TriangleSoup& soup, std::uint32_t material, std::uint32_t group) {
  const auto last = static_cast<std::uint32_t>(soup.vertices.size());
  soup.triangles.emplace_back(last - 3, last - 2, last - 1);
  soup.material.push_back(material);
  soup.group.push_back(group);
}

TriangleSoup read_binary(const MeshSource& source, std::uint64_t n_facets) {
  require_countable(source, 3 * n_facets);
  source.budget.require_mesh(3 * n_facets, n_facets, source.name);
  TriangleSoup soup;
  soup.reserve(3 * n_facets, n_facets);
  soup.single_precision = true;
  const std::uint32_t material = soup.materials.index(""), group = soup.groups.index("");
  ReadProgress progress(source);
  for (std::uint64_t n = 0; n < n_facets; ++n) {
    const std::size_t position = kHeaderBytes + n * kFacetBytes;
    progress.at(position);
    const char* corner = source.bytes.data() + position + 12;
    for (int c = 0; c < 3; ++c, corner += 12) {
      const glm::dvec3 vertex(std::bit_cast<float>(load_u32(corner)),
                              std::bit_cast<float>(load_u32(corner + 4)),
                              std::bit_cast<float>(load_u32(corner + 8)));
      if (!is_finite(vertex)) {
        fail(source, "triangle " + with_thousands(n) + ": " + not_finite(vertex));
      }
      soup.vertices.push_back(vertex);
    }
    add_facet(soup, material, group);
  }
  return with_triangles(source, std::move(soup));
}

std::uint64_t count_words(std::string_view text, std::string_view word) {
  std::uint64_t count = 0;
  for (std::size_t at = text.find(word); at != std::string_view::npos;
       at = text.find(word, at + word.size())) {
    ++count;
  }
  return count;
}

/// "facet normal 0 0 1 outer loop vertex … vertex … vertex … endloop endfacet", separated by blanks of any kind.
TriangleSoup read_ascii(const MeshSource& source) {
  const std::uint64_t n_facets = count_words(source.bytes, "endfacet");
  require_countable(source, 3 * n_facets);
  source.budget.require_mesh(3 * n_facets, n_facets, source.name);

  TriangleSoup soup;
  soup.reserve(3 * n_facets, n_facets);
  const std::uint32_t material = soup.materials.index("");
  std::uint32_t group = soup.groups.index("");
  ReadProgress progress(source);
  TextCursor cursor(source.bytes);
  std::uint64_t n_corners = 0;
  bool in_facet = false;
  const auto unexpected = [&](const std::string& expected, std::string_view found) {
    fail_at_line(
        source, cursor.line_number(),
        "expected " + expected + ", found " +
            (found.empty() ? "the end of the file; it is cut off or damaged" : in_quotes(found)));
  };

  for (std::string_view word = cursor.next_token(); !word.empty(); word = cursor.next_token()) {
    progress.at(cursor.position());
    if (word == "vertex") {
      if (!in_facet || n_corners == 3) unexpected(in_facet ? "'endloop'" : "'facet'", word);
      glm::dvec3 vertex;
      for (int axis = 0; axis < 3; ++axis) {
        const std::string_view token = cursor.next_token();
        const std::optional<double> value = parse_real(token);
        if (!value) unexpected("three coordinates after 'vertex'", token);
        vertex[axis] = *value;
      }
      if (!is_finite(vertex)) fail_at_line(source, cursor.line_number(), not_finite(vertex));
      soup.vertices.push_back(vertex);
      ++n_corners;
    } else if (word == "facet") {
      if (in_facet) unexpected("'endfacet'", word);
      in_facet = true;
      n_corners = 0;
    } else if (word == "endfacet") {
      if (!in_facet || n_corners != 3) unexpected("three vertices in a facet", word);
      add_facet(soup, material, group);
      in_facet = false;
    } else if (word == "solid" || word == "endsolid") {
      if (in_facet) unexpected("'endfacet'", word);
      // The name is the rest of the line and may be empty.
      std::string_view name;
      cursor.next_line(name);
      if (word == "solid") {
        const std::size_t begin = name.find_first_not_of(" \t");
        name = begin == std::string_view::npos ? "" : name.substr(begin);
        group = soup.groups.index(name.substr(0, name.find_last_not_of(" \t") + 1));
      }
    } else if (!in_facet) {
      unexpected("'facet' or 'endsolid'", word);
    }
  }
  if (in_facet) unexpected("'endfacet'", {});
  return with_triangles(source, std::move(soup));
}

}  // namespace

TriangleSoup read_stl(const MeshSource& file) {
  const bool has_header = file.bytes.size() >= kHeaderBytes;
  const std::uint64_t n_facets = has_header ? load_u32(file.bytes.data() + 80) : 0;
  const std::uint64_t expected = kHeaderBytes + n_facets * kFacetBytes;
  // Binary files may begin with "solid" too: only the length identifies them.
  if (has_header && file.bytes.size() == expected) return read_binary(file, n_facets);
  const MeshSource source = text_source(file);
  std::string_view rest = source.bytes.substr(0, 256);
  rest = rest.substr(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
  const bool text = rest.substr(0, 5) == "solid" && rest.find('\0') == std::string_view::npos;
  if (text) return read_ascii(source);
  if (!has_header) {
    fail(file, "expected an STL file, found " + counted(file.bytes.size(), "byte", "bytes") +
                     ": a binary one has at least 84, an ASCII one begins with 'solid'");
  }
  if (file.bytes.size() < expected) {
    fail(file, "the header promises " + counted(n_facets, "triangle", "triangles") + " in " +
                     with_thousands(expected) + " bytes, found " +
                     with_thousands(file.bytes.size()) + "; the file is cut off or damaged");
  }
  return read_binary(file, n_facets);
}

}  // namespace sarnerf
