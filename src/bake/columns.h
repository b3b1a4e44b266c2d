// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// Square lattice over the horizontal plane. One vertical line passes through the centre of each cell:
/// line (i, k) at x = x_m + (i + ½) spacing_m, z = z_m + (k + ½) spacing_m.
struct ColumnLattice {
  double x_m = 0.0;  ///< corner of cell (0, 0), world coordinates
  double z_m = 0.0;
  double spacing_m = 1.0;
  std::uint32_t n_x = 0;
  std::uint32_t n_z = 0;
};

/// The lattice over a box, without cells if the box is empty. A spacing of 0 gives about 512 cells along the
/// box's longer side. Throws UsageError for a spacing that is negative, not finite, or gives more than 8192 cells
/// a side.
ColumnLattice column_lattice(const Box& box, double spacing_m);

/// Index of the first line at or beyond a coordinate, of n lines at corner_m + (index + ½) spacing_m; n when there
/// is none. Monotonic in the coordinate and a function of it alone: all decisions on which neighbouring triangles must
/// agree use it.
std::uint32_t first_line(double coordinate_m, double corner_m, double spacing_m, std::uint32_t n);

/// Intersection of a solid with the lines of a lattice: intervals of height in which its winding number is above zero.
/// Overlapping closed pieces thus become their union, cavities stay empty, and a mesh that faces inward has no
/// intervals. Memory: 24 bytes an interval.
struct Columns {
  struct Interval {
    std::uint32_t i = 0;  ///< column along x
    double bottom_m = 0.0;
    double top_m = 0.0;
  };

  ColumnLattice lattice;
  std::vector<std::size_t> row_begin;  ///< [n_z + 1]: intervals of lattice row k, by column, then by height
  std::vector<Interval> intervals;     ///< those of one column do not overlap
  std::uint64_t n_met = 0;             ///< lines that meet the surface
  std::uint64_t n_open = 0;  ///< of these, lines whose winding number does not return to zero: the mesh has holes

  double volume_m3() const;
};

/// Intersects a mesh with the lines. Each line's crossings with a closed mesh cancel exactly, also where it runs
/// through an edge, a corner or along a wall: neighbouring triangles share the rounded ends of their half-open
/// spans. Vertical triangles have no span. The part of a line above the last crossing is outside of
/// the solid. Expects valid vertex indices and finite coordinates. Throws Interrupted on request. Cost:
/// proportional to the pairs of rows and triangles that meet, and to the crossings, on all threads.
Columns columns_of(const SurfaceMesh& mesh, const ColumnLattice& lattice, const Monitor& monitor = {});

/// Volume of the intersection of two solids over the same lattice (m³).
double common_volume_m3(const Columns& a, const Columns& b);

/// Where a vertical line meets a mesh.
struct LineCrossing {
  std::uint32_t i = 0;  ///< index of the line along x
  int turn = 0;         ///< change of the winding number on the way up: +1 into the solid, −1 out of it
  double y_m = 0.0;
};

/// Crossings of a mesh with the vertical lines of a lattice, row by row. Along each line those of a closed mesh
/// cancel exactly, also where it runs through an edge, a corner or along a wall: neighbouring triangles share the
/// rounded ends of their half-open spans. Vertical triangles have no span. Expects valid vertex indices
/// and finite coordinates; mesh and lattice must outlive this.
class LineCrossings {
 public:
  LineCrossings(const SurfaceMesh& mesh, const ColumnLattice& lattice);

  /// Replaces `crossings` by those of lattice row k, sorted by line, then by height. Any number of threads may call.
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

/// The space that a mesh encloses although it is not closed: air (a flood fill) from above and from the sides does not
/// reach it. The mesh stands on the ground, so no air enters from below its box; triangles may face either way.
///
/// Air spreads from centre to centre of the lattice's cubic cells, along the axes, and through no triangle. Holes
/// narrower than a cell keep it out, wider ones let it in; cavities count as filled. Columns end where they cross the
/// surface, not at borders of cells. Solids thinner than a cell may be missed. `n_met` and `n_open` stay 0.
///
/// The box must hold the mesh, and the lattice the box. Throws UsageError when there are more than 2³⁰ cells, of a
/// byte each; Interrupted on request. Cost: about 10 ns a cell, and three times that of columns_of().
Columns enclosed_columns(const SurfaceMesh& mesh, const Box& box_m, const ColumnLattice& lattice,
                         const Monitor& monitor = {});

}  // namespace sarnerf
