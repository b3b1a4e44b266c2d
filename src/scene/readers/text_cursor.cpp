// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <limits>

#include "readers/readers.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}

char first_line_end(std::string_view text) {
  const std::size_t first = text.find_first_of("\r\n");
  if (first == std::string_view::npos || text[first] == '\n') return '\n';
  // Lines of text that was converted twice end with "\r\r\n".
  const std::size_t behind = text.find_first_not_of('\r', first);
  return behind != std::string_view::npos && text[behind] == '\n' ? '\n' : '\r';
}

/// from_chars accepts no leading plus.
std::string_view without_plus(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-' && token[1] != '+') {
    token.remove_prefix(1);
  }
  return token;
}

}  // namespace

std::string_view take_token(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view token = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return token;
}

std::optional<double> parse_real(std::string_view token) {
  token = without_plus(token);
  double value = 0.0;
  const char* end = token.data() + token.size();
  const auto result = std::from_chars(token.data(), end, value);
  if (token.empty() || result.ptr != end) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) {
    const std::size_t exponent = token.find_first_of("eE");
    const bool tiny = exponent != std::string_view::npos && token.substr(exponent + 1, 1) == "-";
    return tiny ? 0.0 : std::numeric_limits<double>::infinity();
  }
  if (result.ec != std::errc()) return std::nullopt;
  return value;
}

std::optional<std::int64_t> parse_integer(std::string_view token) {
  token = without_plus(token);
  std::int64_t value = 0;
  const char* end = token.data() + token.size();
  const auto result = std::from_chars(token.data(), end, value);
  if (token.empty() || result.ptr != end || result.ec != std::errc()) return std::nullopt;
  return value;
}

TextCursor::TextCursor(std::string_view text) : text_(text), line_end_(first_line_end(text)) {}

bool TextCursor::next_line(std::string_view& line) {
  if (position_ >= text_.size()) return false;
  if (!in_line_) ++line_number_;
  in_line_ = false;
  const std::string_view rest = text_.substr(position_);
  const void* found = std::memchr(rest.data(), line_end_, rest.size());
  const std::size_t length =
      found ? static_cast<std::size_t>(static_cast<const char*>(found) - rest.data()) : rest.size();
  line = rest.substr(0, length);
  position_ += found ? length + 1 : length;
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return true;
}

std::string_view TextCursor::next_token() {
  while (position_ < text_.size()) {
    if (!in_line_) {
      ++line_number_;
      in_line_ = true;
    }
    const char c = text_[position_];
    if (c == line_end_) {
      in_line_ = false;
      ++position_;
    } else if (is_blank(c)) {
      ++position_;
    } else {
      const std::size_t begin = position_;
      while (position_ < text_.size() && text_[position_] != line_end_ && !is_blank(text_[position_])) {
        ++position_;
      }
      return text_.substr(begin, position_ - begin);
    }
  }
  return {};
}

namespace {

std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

using Reader = TriangleSoup (*)(const MeshSource&);

Reader reader_of(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".obj") return read_obj;
  if (extension == ".ply") return read_ply;
  if (extension == ".stl") return read_stl;
  if (extension == ".off") return read_off;
  return nullptr;
}

}  // namespace

void fail(const MeshSource& source, const std::string& message) {
  throw InputError(in_one_line(source.name + ": " + message));
}

void fail_at_line(const MeshSource& source, std::uint64_t line, const std::string& message) {
  throw InputError(in_one_line(source.name + ":" + std::to_string(line) + ": " + message));
}

MeshSource text_source(MeshSource source) {
  source.bytes = without_byte_order_mark(source.bytes, source.name);
  return source;
}

void require_countable(const MeshSource& source, std::uint64_t n_vertices) {
  if (n_vertices > std::numeric_limits<std::uint32_t>::max()) {
    fail(source, with_thousands(n_vertices) +
                     " vertices, but at most 4,294,967,295 can be indexed; "
                     "cut the mesh into several files and list them in a scene file");
  }
}

TriangleSoup with_triangles(const MeshSource& source, TriangleSoup soup) {
  // Sides of triangles are counted in 32 bits.
  if (soup.triangles.size() > std::numeric_limits<std::uint32_t>::max() / 4) {
    fail(source, with_thousands(soup.triangles.size()) +
                     " triangles, but at most 1,073,741,823 can be "
                     "told apart; cut the mesh into several files and list them in a scene file");
  }
  if (!soup.triangles.empty()) return soup;
  std::string found = counted(soup.vertices.size(), "vertex", "vertices");
  if (soup.n_ignored_faces > 0) {
    found +=
        " and " + counted(soup.n_ignored_faces, "face", "faces") + " of fewer than three corners";
  }
  fail(source, "expected triangles, found " + found +
                   " and no surface; point clouds need a mesh made from them first");
}

std::string not_finite(const glm::dvec3& vertex) {
  return "expected a finite vertex, found (" + number_text(vertex.x) + ", " +
         number_text(vertex.y) + ", " + number_text(vertex.z) +
         "); remove it and the faces that use it, or export again";
}

bool is_mesh_file(const std::filesystem::path& path) { return reader_of(path) != nullptr; }

TriangleSoup read_mesh(const std::filesystem::path& path, const MeshSource& source) {
  const Reader reader = reader_of(path);
  if (reader == nullptr) {
    fail(source, "expected a file ending in .obj, .ply, .stl, .off or .json, found " +
                     in_quotes(path.extension().string()) +
                     "; convert the mesh or rename the file");
  }
  return reader(source);
}

std::string read_file(const std::filesystem::path& path, const MemoryBudget& budget) {
  const std::uint64_t size = regular_file_size(path);
  if (size == 0) throw InputError(path.string() + ": the file is empty; export it again");
  budget.require_file(size, path.string());
  return read_whole_file(path);
}

}  // namespace sarnerf
