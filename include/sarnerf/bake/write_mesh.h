// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "sarnerf/bake/surface_mesh.h"

namespace sarnerf {

/// Throws UsageError unless the path ends in .ply or .obj, in letters of either case; for asking before long work.
void require_mesh_ending(const std::filesystem::path& path);

/// Writes the surface as binary PLY (little-endian, float64 coordinates) or OBJ (as many digits as name each double),
/// by the path's ending, replacing what was there once all is written. load_scene() reads back the very same triangles, in
/// map coordinates too, and numbers vertices anew unless triangles name them in their order, as level_surface() does.
///
/// Comments at the top say units (m), up axis (Y) and `provenance`, one comment per line of it; the time and other
/// things that differ from run to run are not written, so the same mesh and provenance give the same bytes.
///
/// Throws UsageError for another ending, before anything is written, and for more than 2³¹ vertices, which no reader
/// of PLY takes; Error for a full disk or a folder that cannot be written. Cost: the file once in memory, 24 bytes a
/// vertex and 13 a triangle as PLY, some twice as many as OBJ.
void write_mesh(const SurfaceMesh& mesh, const std::filesystem::path& path, std::string_view provenance = {});

}  // namespace sarnerf
