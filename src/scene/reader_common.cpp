// SPDX-License-Identifier: Apache-2.0
#include "reader_common.h"

#include <algorithm>
#include <cctype>
#include <limits>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/input_text.h"
#include "text.h"

namespace sarnerf {
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
                     " vertices, but at most 4,294,967,295 can be told apart; "
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
