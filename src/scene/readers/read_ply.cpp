// SPDX-License-Identifier: Apache-2.0
// Own reader, because no library of the distribution gives access to the properties of faces.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "readers/readers.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class PlyEncoding { ascii, little_endian, big_endian };

std::size_t byte_size(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      break;
  }
  return 8;
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;         ///< of the value, or of each value of a list
  std::optional<PlyType> list_count_type;  ///< set for lists

  /// Least bytes in a binary file: those of a number or of an empty list.
  std::size_t least_bytes() const { return byte_size(list_count_type.value_or(type)); }
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Index of the first property with one of these names.
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
  std::size_t body_begin = 0;        ///< first byte after the header
  std::uint64_t n_lines = 0;         ///< of the header
};

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypes = {{
    {"char", PlyType::int8},
    {"int8", PlyType::int8},
    {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},
    {"short", PlyType::int16},
    {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},
    {"uint16", PlyType::uint16},
    {"int", PlyType::int32},
    {"int32", PlyType::int32},
    {"uint", PlyType::uint32},
    {"uint32", PlyType::uint32},
    {"float", PlyType::float32},
    {"float32", PlyType::float32},
    {"double", PlyType::float64},
    {"float64", PlyType::float64},
}};

/// More than genuine headers have; stops hostile headers of many megabytes.
constexpr std::size_t kMaxProperties = 1024;

class HeaderParser {
 public:
  explicit HeaderParser(const MeshSource& source) : source_(source), cursor_(source.bytes) {}

  PlyHeader parse() {
    std::string_view line;
    if (!cursor_.next_line(line) || take_token(line) != "ply") {
      fail_at_line(source_, 1, "expected a PLY file, which begins with the line 'ply'");
    }
    bool has_format = false;
    while (true) {
      if (!cursor_.next_line(line)) {
        fail_at_line(source_, cursor_.line_number(),
                     "expected 'end_header', found the end of the file; it is cut off or damaged");
      }
      const std::string_view keyword = take_token(line);
      if (keyword == "end_header") break;
      if (keyword == "format") {
        parse_format(line);
        has_format = true;
      } else if (keyword == "element") {
        parse_element(line);
      } else if (keyword == "property") {
        parse_property(line);
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
        expected("format, element, property, comment or end_header", keyword);
      }
    }
    if (!has_format)
      fail_at_line(source_, cursor_.line_number(), "the header has no line 'format'");
    header_.body_begin = cursor_.position();
    header_.n_lines = cursor_.line_number();
    check_counts();
    return std::move(header_);
  }

 private:
  [[noreturn]] void expected(const std::string& what, std::string_view found) const {
    fail_at_line(source_, cursor_.line_number(),
                 "expected " + what + ", found " + in_quotes(found));
  }

  void parse_format(std::string_view rest) {
    const std::string_view format = take_token(rest);
    if (format == "ascii") {
      header_.encoding = PlyEncoding::ascii;
    } else if (format == "binary_little_endian") {
      header_.encoding = PlyEncoding::little_endian;
    } else if (format == "binary_big_endian") {
      header_.encoding = PlyEncoding::big_endian;
    } else {
      expected("ascii, binary_little_endian or binary_big_endian", format);
    }
    const std::string_view version = take_token(rest);
    if (version != "1.0") expected("version 1.0", version);
  }

  void parse_element(std::string_view rest) {
    PlyElement element;
    element.name = take_token(rest);
    const std::string_view token = take_token(rest);
    const std::optional<std::int64_t> count = parse_integer(token);
    if (element.name.empty() || !count || *count < 0) {
      expected("a name and a count after 'element'", token);
    }
    element.count = static_cast<std::uint64_t>(*count);
    header_.elements.push_back(std::move(element));
  }

  PlyType parse_type(std::string_view token, bool integral) const {
    for (const auto& [name, type] : kTypes) {
      const bool is_real = type == PlyType::float32 || type == PlyType::float64;
      if (name == token && !(integral && is_real)) return type;
    }
    expected(integral ? "an integer type for a list's length" : "a type such as float or int",
             token);
  }

  void parse_property(std::string_view rest) {
    PlyProperty property;
    std::string_view token = take_token(rest);
    if (token == "list") {
      property.list_count_type = parse_type(take_token(rest), true);
      token = take_token(rest);
    }
    property.type = parse_type(token, false);
    property.name = take_token(rest);
    if (property.name.empty()) expected("a name for the property", "");
    if (header_.elements.empty()) expected("an element before its properties", property.name);
    if (++n_properties_ > kMaxProperties) expected("at most 1,024 properties", property.name);
    header_.elements.back().properties.push_back(std::move(property));
  }

  /// Compares counts with the bytes that follow. Elements without properties take no bytes, and nothing is read
  /// or stored for them.
  void check_counts() const {
    const std::uint64_t available = source_.bytes.size() - header_.body_begin;
    for (const PlyElement& element : header_.elements) {
      std::uint64_t least = 0;
      for (const PlyProperty& property : element.properties) {
        least += header_.encoding == PlyEncoding::ascii ? 2 : property.least_bytes();
      }
      // The last number of a text needs no blank after it.
      if (least != 0 && element.count > (available + 1) / least) {
        fail(source_, "the header promises " + with_thousands(element.count) + " of element " +
                          in_quotes(element.name) + " with at least " + with_thousands(least) +
                          " bytes each, but only " + with_thousands(available) +
                          " bytes follow; the file is cut off or damaged");
      }
    }
  }

  const MeshSource& source_;
  TextCursor cursor_;
  PlyHeader header_;
  std::size_t n_properties_ = 0;
};

/// Parses "ply … end_header" and checks each count against the bytes that follow.
PlyHeader read_ply_header(const MeshSource& source) { return HeaderParser(source).parse(); }

/// Reads the numbers of the body one by one, in any encoding.
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

  /// A list's length, checked against the bytes that are left: a value takes its size, at least 2 bytes in ASCII.
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
  // Equal ids come in long runs: the name is looked up only when the id changes.
  std::optional<double> last_id;
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
