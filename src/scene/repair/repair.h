// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/parallel.h"
#include "triangle_soup.h"

namespace sarnerf {

/// A mesh whose triangles are sorted out: pieces, their senses, and which of them bound a volume.
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

/// What repair met; each figure that is not zero becomes a line of the report.
struct RepairCounts {
  std::uint64_t merged_vertices = 0;
  std::uint64_t stitched_vertices = 0;
  std::uint64_t repeated_corner_faces = 0;
  std::uint64_t flat_faces = 0;
  std::uint64_t duplicate_faces = 0;
  std::uint64_t interior_faces = 0;  ///< walls between solids that touch
  std::uint64_t split_edges = 0;     ///< shared by three or more faces
  std::uint64_t turned_faces = 0;    ///< to agree with their neighbours
  std::uint64_t turned_pieces = 0;   ///< to face outward
  std::uint64_t cavities = 0;
  std::uint64_t shell_pieces = 0;
  std::uint64_t shell_faces = 0;
  std::uint64_t solids = 0;
};

/// Welds, cleans and orients a mesh:
///
/// - vertices at the same place become one, and those of open borders that only rounding separates (see
///   stitch_borders()); faces with a repeated corner and duplicate faces go;
/// - two faces on the same corners that look opposite ways are either the wall between two solids that
///   touch there, and both go, or a sheet drawn from both sides, and one stays;
/// - edges shared by more than two faces are split, faces turned until neighbours agree;
/// - connected pieces without border are solids and face outward, unless a piece was drawn inside out
///   within another one: that is a cavity and belongs to the piece around it;
/// - everything else is a thin shell. Faces without area hold their neighbours together until then, and
///   go last.
///
/// Faces of different media never share a piece, so that each medium has a boundary of its own.
/// With `mend` false faces stay as they are, and only pieces that are closed, consistent and outward as
/// drawn count as solids. A million triangles take about a second, and up to five where every face needs
/// turning.
RepairedMesh repair_mesh(TriangleSoup soup, const RepairSetup& setup, RepairCounts& counts);

/// One line each, beginning with `prefix`; nothing for what did not occur.
std::vector<std::string> repair_notes(const RepairCounts& counts, const std::string& prefix);

}  // namespace sarnerf
