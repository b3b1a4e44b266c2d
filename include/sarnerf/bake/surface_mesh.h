// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf {

/// The surface of a solid: triangles in world coordinates (m), counter-clockwise seen from outside.
struct SurfaceMesh {
  std::vector<glm::dvec3> vertices_m;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint8_t> unseen{};  ///< of each vertex, 1 where no training view sees it; empty: unknown
};

/// Throws UsageError unless the path ends in .ply or .obj, in upper or lower case. To be called before long work.
void require_mesh_ending(const std::filesystem::path& path);

/// Writes the surface as binary PLY (little-endian, float64 coordinates) or OBJ (the shortest digits that identify each
/// double), by the path's ending. An existing file is replaced once the new one is complete. load_scene() reads back exactly
/// the same triangles, in map coordinates, too. It renumbers vertices, unless they are in the order in which triangles first
/// use them, as those of level_surface() are.
///
/// PLY has `unseen` as a property of vertices (uchar) where it is known.
///
/// Comments at the top state units (m), up axis (Y) and `provenance`, one comment per line of it. The time and other
/// things that differ from run to run are not written, so the same mesh and provenance give the same bytes.
///
/// Throws UsageError for another ending, before anything is written, and for 2³¹ vertices or more, which no reader of PLY
/// accepts; Error for a full disk or a folder that cannot be written. Cost: the file once in memory, 24 bytes a vertex and
/// 13 a triangle as PLY, about twice as many as OBJ.
void write_mesh(const SurfaceMesh& mesh, const std::filesystem::path& path, std::string_view provenance = {});

struct PreviewOptions {
  int width = 1200;                ///< pixels, at least 200
  int height = 900;                ///< pixels, at least 200
  double azimuth_rad = 0.5236;     ///< of the oblique view: 0 looks from +Z, growing towards +X, as a radar's; 30°
  double elevation_rad = 0.6109;   ///< of the oblique view, above the horizon; 35°
};

/// One picture of a surface on white ground: at the left an oblique view, at the right from top to bottom the surface
/// from above (X to the right, Z down), from the front (from +Z: X to the right, Y up) and from the side (from +X: −Z
/// to the right, Y up). All four are orthographic and labelled; the three share one scale. Each has a scale bar of
/// 1, 2 or 5 × 10ⁿ metres and small arrows along the axes, red for X, green for Y, blue for Z. Facets are shaded by
/// their inclination to a light behind the viewer's left shoulder, plus ambient light, and grow paler with depth.
/// Back faces, which a closed surface does not show, are red.
///
/// Row i is the picture's line from the top, column j its pixel from the left. 2 × 2 rays a pixel, nearest hits only, by
/// RayTracer in float32 relative to the centre of the surface's box. An empty mesh gives a white picture. Throws UsageError for
/// fewer pixels than 200 a side, more than 16384, or an angle that is not finite. Cost: 0.5 s at 1200 × 900 on one
/// thread, and Embree's tree of the triangles.
Image<Colour> preview(const SurfaceMesh& mesh, const PreviewOptions& options = {});

}  // namespace sarnerf
