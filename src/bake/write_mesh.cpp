// SPDX-License-Identifier: Apache-2.0
// Own writers: CGAL's write no comments and, by default, too few digits of doubles.
#include "sarnerf/bake/surface_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <concepts>
#include <limits>
#include <string>

#include "sarnerf/core/files.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

std::string lower_case_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return ending;
}

/// The comment lines, each after `mark`.
std::string comments(const char* mark, std::string_view provenance) {
  std::string text = std::string(mark) + " sarnerf surface\n" + mark + " units: m\n" + mark + " up axis: Y\n";
  while (!provenance.empty()) {
    const std::size_t end = std::min(provenance.find('\n'), provenance.size());
    std::string line(provenance.substr(0, end));
    // A carriage return ends a line for some readers.
    std::replace_if(line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
    text += std::string(mark) + " " + line + "\n";
    provenance.remove_prefix(std::min(end + 1, provenance.size()));
  }
  return text;
}

template <std::unsigned_integral T>
void append_little_endian(std::string& bytes, T bits) {
  for (std::size_t n = 0; n < sizeof(T); ++n) bytes.push_back(static_cast<char>(bits >> 8 * n & 0xff));
}

std::string ply_bytes(const SurfaceMesh& mesh, std::string_view provenance) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\n" + comments("comment", provenance) + "element vertex " +
                      std::to_string(mesh.vertices_m.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z" +
                      (mesh.unseen.empty() ? "" : "\nproperty uchar unseen") + "\nelement face " +
                      std::to_string(mesh.triangles.size()) +
                      "\nproperty list uchar int vertex_indices\nend_header\n";
  bytes.reserve(bytes.size() + 25 * mesh.vertices_m.size() + 13 * mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.vertices_m.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) append_little_endian(bytes, std::bit_cast<std::uint64_t>(mesh.vertices_m[v][axis]));
    if (!mesh.unseen.empty()) bytes.push_back(static_cast<char>(mesh.unseen[v]));
  }
  for (const glm::uvec3& triangle : mesh.triangles) {
    bytes.push_back(3);
    for (int n = 0; n < 3; ++n) append_little_endian(bytes, std::uint32_t{triangle[n]});
  }
  return bytes;
}

/// Shortest digits that identify the number; the same in every locale.
template <class T>
void append_number(std::string& text, T value) {
  std::array<char, 32> digits;
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

std::string obj_text(const SurfaceMesh& mesh, std::string_view provenance) {
  // A comment that ends in a backslash continues on the next line, which is therefore empty.
  std::string text = comments("#", provenance) + "\n";
  for (const glm::dvec3& vertex : mesh.vertices_m) {
    text += 'v';
    for (int axis = 0; axis < 3; ++axis) append_number(text += ' ', vertex[axis]);
    text += '\n';
  }
  for (const glm::uvec3& triangle : mesh.triangles) {
    text += 'f';
    for (int n = 0; n < 3; ++n) append_number(text += ' ', std::uint64_t{triangle[n]} + 1);
    text += '\n';
  }
  return text;
}

}  // namespace

void require_mesh_ending(const std::filesystem::path& path) {
  const std::string ending = lower_case_ending(path);
  if (ending == ".ply" || ending == ".obj") return;
  throw UsageError(path.string() + ": expected a mesh file that ends in .ply or .obj, found " +
                   (ending.empty() ? "no ending" : path.extension().string()) + "; choose one of the two");
}

void write_mesh(const SurfaceMesh& mesh, const std::filesystem::path& path, std::string_view provenance) {
  require_mesh_ending(path);
  if (mesh.vertices_m.size() > std::numeric_limits<std::int32_t>::max()) {
    throw UsageError(path.string() + ": expected a surface of less than 2^31 vertices, found " +
                     std::to_string(mesh.vertices_m.size()) + "; choose larger voxels");
  }
  write_file_atomically(path, lower_case_ending(path) == ".ply" ? ply_bytes(mesh, provenance)
                                                                 : obj_text(mesh, provenance));
}

}  // namespace sarnerf
