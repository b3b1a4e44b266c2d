// SPDX-License-Identifier: Apache-2.0
// Own reader, because no library of the distribution gives access to the properties of faces.
#include <bit>
#include <cmath>

#include "ply_header.h"
#include "reader_common.h"
#include "text.h"
#include "text_cursor.h"

namespace sarnerf {
namespace {

/// Numbers of the body, one after the other, whatever their encoding.
class PlyBody {
 public:
  PlyBody(const MeshSource& source, const PlyHeader& header)
      : source_(source),
        encoding_(header.encoding),
        header_lines_(header.n_lines),
        body_(source.bytes.substr(header.body_begin)),
        text_(body_) {}

  double next(PlyType type, const PlyElement& element, std::uint64_t index) {
    if (encoding_ == PlyEncoding::ascii) {
      const std::string_view token = text_.next_token();
      const std::optional<double> value = parse_real(token);
      if (!value) {
        fail_at_line(source_, header_lines_ + text_.line_number(),
                     "expected a number of " + in_one_line(element.name, 60) + " " + std::to_string(index) +
                         ", found " +
                         (token.empty() ? "the end of the file; it is cut off or damaged"
                                        : in_quotes(token)));
      }
      return *value;
    }
    const std::size_t size = byte_size(type);
    if (body_.size() - position_ < size) {
      fail(source_, "expected " + in_one_line(element.name, 60) + " " + std::to_string(index) + " of " +
                        std::to_string(element.count) +
                        ", found the end of the file; it is cut off or damaged");
    }
    std::uint64_t bits = 0;
    for (std::size_t n = 0; n < size; ++n) {
      const std::size_t from_top = encoding_ == PlyEncoding::big_endian ? n : size - 1 - n;
      bits = (bits << 8) | static_cast<unsigned char>(body_[position_ + from_top]);
    }
    position_ += size;
    return value_of(bits, type);
  }

  /// A list's length, checked against the bytes that are left: each value takes at least one.
  std::size_t next_length(const PlyProperty& property, const PlyElement& element,
                          std::uint64_t index) {
    const double length = next(*property.list_count_type, element, index);
    const std::size_t least = encoding_ == PlyEncoding::ascii ? 2 : byte_size(property.type);
    if (!(length >= 0.0) || length != std::floor(length) ||
        length > static_cast<double>((remaining() + 1) / least)) {
      fail(source_, in_one_line(element.name, 60) + " " + std::to_string(index) + ": a list of " +
                        number_text(length) + " values, but " +
                        counted(remaining(), "byte is", "bytes are") +
                        " left; the file is damaged");
    }
    return static_cast<std::size_t>(length);
  }

  std::size_t position() const {
    return encoding_ == PlyEncoding::ascii ? text_.position() : position_;
  }

 private:
  static double value_of(std::uint64_t bits, PlyType type) {
    switch (type) {
      case PlyType::int8:
        return static_cast<std::int8_t>(bits);
      case PlyType::int16:
        return static_cast<std::int16_t>(bits);
      case PlyType::int32:
        return static_cast<std::int32_t>(bits);
      case PlyType::float32:
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
      case PlyType::float64:
        return std::bit_cast<double>(bits);
      default:
        return static_cast<double>(bits);
    }
  }
  std::size_t remaining() const { return body_.size() - position(); }

  const MeshSource& source_;
  PlyEncoding encoding_;
  std::uint64_t header_lines_;
  std::string_view body_;
  TextCursor text_;
  std::size_t position_ = 0;
};

void skip(PlyBody& body, const PlyProperty& property, const PlyElement& element,
          std::uint64_t index) {
  const std::size_t n_values =
      property.list_count_type ? body.next_length(property, element, index) : 1;
  for (std::size_t n = 0; n < n_values; ++n) body.next(property.type, element, index);
}

void read_vertices(const MeshSource& source, PlyBody& body, ReadProgress& progress,
                   const PlyElement& element, TriangleSoup& soup) {
  std::vector<int> axis_of(element.properties.size(), -1);
  int axis = 0;
  for (const char* name : {"x", "y", "z"}) {
    const std::optional<std::size_t> property = element.find(name);
    if (!property || element.properties[*property].list_count_type) {
      fail(source, std::string("expected vertices with the numbers x, y and z, found no ") + name);
    }
    axis_of[*property] = axis++;
  }
  for (std::uint64_t index = 0; index < element.count; ++index) {
    progress.at(body.position());
    glm::dvec3 vertex(0.0);
    for (std::size_t n = 0; n < element.properties.size(); ++n) {
      if (axis_of[n] < 0) {
        skip(body, element.properties[n], element, index);
      } else {
        vertex[axis_of[n]] = body.next(element.properties[n].type, element, index);
      }
    }
    if (!is_finite(vertex))
      fail(source, "vertex " + std::to_string(index) + ": " + not_finite(vertex));
    soup.vertices.push_back(vertex);
  }
}

void read_faces(const MeshSource& source, PlyBody& body, ReadProgress& progress,
                const PlyElement& element, std::uint64_t n_vertices, TriangleSoup& soup) {
  const std::optional<std::size_t> corner_list = element.find("vertex_indices", "vertex_index");
  if (!corner_list || !element.properties[*corner_list].list_count_type) {
    fail(source,
         "expected faces with a list vertex_indices, found none; "
         "triangle strips need to be converted to faces");
  }
  const std::size_t none = element.properties.size();
  std::size_t material_id =
      element.find("mat", "material", "material_id", "material_index").value_or(none);
  if (material_id != none && element.properties[material_id].list_count_type) material_id = none;

  const std::uint32_t group = soup.groups.index("");
  PolygonCutter cutter(soup);
  std::vector<std::uint32_t> corners;
  const auto face_name = [](std::uint64_t index) { return "face " + std::to_string(index) + ": "; };
  // Ids come in long runs: the name is looked up when the id changes.
  double last_id = -1.0;
  std::uint32_t material = soup.materials.index("");
  for (std::uint64_t index = 0; index < element.count; ++index) {
    progress.at(body.position());
    for (std::size_t n = 0; n < element.properties.size(); ++n) {
      const PlyProperty& property = element.properties[n];
      if (n == corner_list) {
        const std::size_t n_corners = body.next_length(property, element, index);
        if (n_corners > kMaxCorners) {
          fail(source, face_name(index) + with_thousands(n_corners) + " corners, at most " +
                           with_thousands(kMaxCorners) + " are cut; triangulate the mesh first");
        }
        corners.clear();
        for (std::size_t c = 0; c < n_corners; ++c) {
          const double corner = body.next(property.type, element, index);
          if (!(corner >= 0.0 && corner < static_cast<double>(n_vertices)) ||
              corner != std::floor(corner)) {
            fail(source, face_name(index) + "names vertex " + number_text(corner) +
                             ", but the file has vertices 0 to " +
                             number_text(static_cast<double>(n_vertices) - 1.0) +
                             "; the file is damaged");
          }
          corners.push_back(static_cast<std::uint32_t>(corner));
        }
      } else if (n == material_id) {
        const double id = body.next(property.type, element, index);
        if (id == last_id) continue;
        constexpr double kLargestId = 1e15;
        if (!(std::abs(id) < kLargestId) || id != std::floor(id)) {
          fail(source, face_name(index) + "expected an integer as " + property.name + ", found " +
                           number_text(id));
        }
        last_id = id;
        material = soup.materials.index(std::to_string(static_cast<std::int64_t>(id)));
      } else {
        skip(body, property, element, index);
      }
    }
    cutter.add(corners, material, group);
  }
}

}  // namespace

TriangleSoup read_ply(const MeshSource& file) {
  const MeshSource source = text_source(file);
  const PlyHeader header = read_ply_header(source);
  std::uint64_t n_vertices = 0, n_faces = 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex") n_vertices += element.count;
    if (element.name == "face") n_faces += element.count;
  }
  require_countable(source, n_vertices);
  source.budget.require_mesh(n_vertices, n_faces, source.name);

  TriangleSoup soup;
  PlyBody body(source, header);
  ReadProgress progress(source);
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    if (element.name == "vertex") {
      const std::optional<std::size_t> x = element.find("x");
      soup.single_precision |= header.encoding != PlyEncoding::ascii && x && element.properties[*x].type == PlyType::float32;
      soup.vertices.reserve(soup.vertices.size() + element.count);
      read_vertices(source, body, progress, element, soup);
    } else if (element.name == "face") {
      if (soup.vertices.size() < n_vertices) {
        fail(source, "expected the vertices before the faces; write the file with another program");
      }
      soup.reserve(0, soup.triangles.size() + element.count);
      read_faces(source, body, progress, element, n_vertices, soup);
    } else {
      for (std::uint64_t index = 0; index < element.count; ++index) {
        progress.at(body.position());
        for (const PlyProperty& property : element.properties) skip(body, property, element, index);
      }
    }
  }
  return with_triangles(source, std::move(soup));
}

}  // namespace sarnerf
