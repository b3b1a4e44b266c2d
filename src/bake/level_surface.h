// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/bake/extract.h"
#include "sarnerf/bake/surface_mesh.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

/// The surface at which an occupancy, 0 outside and 1 inside, sampled at voxel centres, crosses `level`: one vertex in
/// each cell between eight centres and each sheet of the surface through it, the mean of the places where the cell's
/// edges cross (dual marching cubes, by OpenVDB). Faces along the lattice lie where the occupancy, taken as linear
/// between centres, crosses. Edges between them are cut off within a voxel: a quarter of a voxel's section is missing
/// where two faces of full voxels meet. A sphere of radius R voxels has 1 − 1.1 / R² of its volume.
///
/// The grid's background lies below the level and its transform is uniform scale and translation, into world metres
/// (converted in double, so map coordinates keep their millimetres). Tiles above the level are solid, active or not.
/// Places are rounded to 1/1024 of a voxel. Every edge has two triangles, one along each direction, also where full
/// voxels touch only at an edge or a corner; where centres hold the level exactly, sheets may meet, and edges there
/// have an even number. No triangle is without area, no vertex without a triangle, no two vertices are at one place.
///
/// Nothing above the level: an empty mesh. Throws NumericsError for a surface that meets values that are not finite,
/// Error where OpenVDB fails. Cost: 0.7 µs a triangle on one thread; memory grows with the surface, not with the
/// volume. Vertices and triangles come in the order of the tree's leaves, whatever the number of threads.
SurfaceMesh level_surface(const openvdb::FloatGrid& occupancy, double level = 0.5);

/// What carved_solid() leaves: 1 in full voxels, 0 in empty ones, voxel (0, 0, 0) in the box's lowest corner. Leaves
/// without any full voxel are not there, full ones are active tiles.
openvdb::FloatGrid::Ptr carved_occupancy(std::span<const PosedImage> images, const CarvingLattice& lattice,
                                         std::optional<double> ground_height_m, const Monitor& monitor);

}  // namespace sarnerf
