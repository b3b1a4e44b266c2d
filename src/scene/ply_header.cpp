// SPDX-License-Identifier: Apache-2.0
#include "ply_header.h"

#include <array>
#include <utility>

#include "text.h"
#include "text_cursor.h"

namespace sarnerf {
namespace {

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

/// A header is written by hand or by a program, not by an attacker with megabytes of it.
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

  /// Elements without properties take no bytes; nothing is read or stored for them.
  void check_counts() const {
    const std::uint64_t available = source_.bytes.size() - header_.body_begin;
    for (const PlyElement& element : header_.elements) {
      std::uint64_t least = 0;
      for (const PlyProperty& property : element.properties) {
        least += header_.encoding == PlyEncoding::ascii ? 2 : property.least_bytes();
      }
      // The last number of a text needs no blank behind it.
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

}  // namespace

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

PlyHeader read_ply_header(const MeshSource& source) { return HeaderParser(source).parse(); }

}  // namespace sarnerf
