// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "column_lattice.h"
#include "sarnerf/bake/surface_mesh.h"

namespace sarnerf {

/// Where a vertical line meets a mesh.
struct LineCrossing {
  std::uint32_t i = 0;  ///< of the line along x
  int turn = 0;         ///< change of the winding number on the way up: +1 into the solid, −1 out of it
  double y_m = 0.0;
};

/// Crossings of a mesh with the vertical lines of a lattice, row by row. Along each line those of a closed mesh
/// cancel exactly, also where it runs through an edge, a corner or along a wall: neighbouring triangles share the
/// rounded ends of their spans, which hold one of both borders. Vertical triangles have no span. Expects corners
/// that exist and finite coordinates; mesh and lattice must outlive this.
class LineCrossings {
 public:
  LineCrossings(const SurfaceMesh& mesh, const ColumnLattice& lattice);

  /// Replaces `crossings` by those of lattice row k, by line, then by height. Any number of threads may call.
  void collect(std::uint32_t k, std::vector<LineCrossing>& crossings) const;

 private:
  void sort_into_rows();
  void add(std::uint32_t k, const glm::uvec3& triangle, std::vector<LineCrossing>& crossings) const;

  const SurfaceMesh& mesh_;
  const ColumnLattice& lattice_;
  std::vector<std::uint32_t> row_of_vertex_;  ///< the first row that lies at or beyond the vertex
  std::vector<std::size_t> begin_;            ///< [n_z + 1], into triangles_
  std::vector<std::uint32_t> triangles_;      ///< by row
};

}  // namespace sarnerf
