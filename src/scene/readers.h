// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "memory_budget.h"
#include "sarnerf/core/monitor.h"
#include "triangle_soup.h"

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
