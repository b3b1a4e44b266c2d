// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/bake/extract.h"
#include "sarnerf/bake/surface_mesh.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

/// The surface at which an occupancy (0 outside, 1 inside, sampled at voxel centres) crosses `level`, by dual marching
/// cubes (OpenVDB). Each cell between eight centres has one vertex for each sheet of the surface through it: the mean of
/// the crossings on the cell's edges. Faces along the lattice lie where the occupancy, interpolated linearly between
/// centres, crosses `level`. The body's edges are bevelled within a voxel: a quarter of a voxel's cross-section is missing
/// where two faces of full voxels meet. A sphere of radius R voxels has 1 − 1.1 / R² of its volume.
///
/// The grid's background must lie below the level. Its transform is uniform scale and translation, into world metres
/// (converted in double, so map coordinates keep their millimetres). Tiles above the level are solid, active or not.
/// Vertices are rounded to 1/1024 of a voxel. Every edge has two triangles, one along each direction, also where full
/// voxels touch only at an edge or a corner. Where values at centres equal the level, sheets may meet, and edges there
/// have an even number of triangles. Every triangle has an area, every vertex a triangle, and no two vertices coincide.
///
/// Nothing above the level: an empty mesh. Throws NumericsError if values at the surface are not finite,
/// Error if OpenVDB fails. Cost: 0.7 µs a triangle on one thread; memory grows with the surface, not with the
/// volume. Vertices and triangles come in the order of the tree's leaves, whatever the number of threads.
SurfaceMesh level_surface(const openvdb::FloatGrid& occupancy, double level = 0.5);

/// Occupancy of carved_solid(): 1 in full voxels, 0 in empty ones; voxel (0, 0, 0) is in the box's lowest corner. Leaves
/// without any full voxel are omitted; full ones are active tiles.
openvdb::FloatGrid::Ptr carved_occupancy(std::span<const PosedImage> images, const CarvingLattice& lattice,
                                         std::optional<double> ground_height_m, const Monitor& monitor);

/// Number of each vertex's component (vertices that triangles connect), in the order of their first vertices; their count last.
std::vector<std::uint32_t> components_of(const SurfaceMesh& mesh);

/// Length, width and height (m) of the component with the largest area: from the 1st to the 99th percentile of its area, along the
/// principal axis of its area's horizontal distribution, across it, and vertically. 0 for a mesh without area. Percentiles leave
/// out antennas, and single voxels at the border of what was learned. Cost: a sort of the triangles for each axis.
glm::dvec3 largest_component_m(const SurfaceMesh& mesh);

}  // namespace sarnerf
