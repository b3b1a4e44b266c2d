// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/parallel.h"
#include "triangle_soup.h"

namespace sarnerf {

/// A mesh divided into pieces of consistently oriented triangles, some of which bound a volume.
struct RepairedMesh {
  std::vector<glm::dvec3> vertices;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> material;  ///< per triangle
  std::vector<std::uint32_t> group;     ///< per triangle
  std::vector<std::uint32_t> piece;     ///< per triangle, index into closed
  std::vector<bool> closed;             ///< per piece
};

struct RepairSetup {
  /// 0 for opaque materials, another number for each translucent one.
  std::vector<std::uint32_t> medium_of_material;
  bool mend = true;
  std::string name;  ///< of the mesh, for messages
  MemoryBudget budget;
  Monitor monitor;
};

/// Numbers of defects and repairs. Each that is not zero becomes a line of the report; shell_faces is part of
/// the line of shell_pieces, and solids has none.
struct RepairCounts {
  std::uint64_t merged_vertices = 0;
  std::uint64_t stitched_vertices = 0;
  std::uint64_t repeated_corner_faces = 0;
  std::uint64_t flat_faces = 0;
  std::uint64_t duplicate_faces = 0;
  std::uint64_t interior_faces = 0;  ///< walls between solids that touch
  std::uint64_t split_edges = 0;     ///< used by three or more faces
  std::uint64_t turned_faces = 0;    ///< reversed to agree with their neighbours
  std::uint64_t turned_pieces = 0;   ///< reversed to face outward
  std::uint64_t cavities = 0;
  std::uint64_t shell_pieces = 0;
  std::uint64_t shell_faces = 0;
  std::uint64_t solids = 0;
};

/// Welds, cleans and orients a mesh:
///
/// - vertices at the same position are merged, and so are vertices of open borders that only rounding
///   separates (see stitch_borders()); faces with a repeated corner and duplicate faces are removed;
/// - two faces on the same corners with opposite normals are either the wall between two touching solids, and
///   both are removed, or a sheet drawn from both sides, and one is kept;
/// - edges with more than two faces are split, and faces are reversed until neighbours agree;
/// - connected pieces without a border are solids and face outward, except pieces drawn inside out within
///   another piece: such a piece is a cavity and belongs to the piece around it;
/// - all other pieces are thin shells. Faces without area keep their neighbours connected until then and are
///   removed last.
///
/// Faces of different media never share a piece, so that each medium has a boundary of its own.
/// If `mend` is false, faces are not changed, and only pieces that are closed, consistent and outward as drawn
/// are solids. A million triangles take about a second, and up to five if every face must be reversed.
RepairedMesh repair_mesh(TriangleSoup soup, const RepairSetup& setup, RepairCounts& counts);

/// One line for each repair that occurred, beginning with `prefix`.
std::vector<std::string> repair_notes(const RepairCounts& counts, const std::string& prefix);

}  // namespace sarnerf
