// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// Cubes that fill a box, the first of them in its lowest corner; the last may reach beyond.
struct CarvingLattice {
  Box box_m;  ///< in the frame of the acquisitions' aim points
  double voxel_size_m = 0.0;
};

/// The solid that is left when everything is taken away of which some view says outright that it is empty: the least
/// that any reconstruction should beat. A voxel is empty if its centre is nearer to some view's radar than the first
/// return of its row there, the near edge of the first pixel above a millionth of the brightest one of all images. No
/// margin, no look at rows beside, no smoothing. A row without any return is empty in all its swath; a place
/// in no view's swath, and one below `ground_height_m`, is empty, too.
///
/// Everything is in one frame, that of the acquisitions' aim points: world coordinates for images as load_images()
/// gives them, relative to the aim point for those of a TrainingSet, whose aim is the origin.
///
/// Returns the surface half-way between full and empty centres, closed, as level_surface() makes it; an empty mesh
/// where nothing is left, as without images. Throws UsageError for an empty box, a voxel size that is not above 0 or
/// more than 8192 voxels along a side; GeometryError for an impossible acquisition; Interrupted. Cost: 7 ns for each
/// voxel that is left and view on one thread, and little for others (the view that emptied the last voxel is asked
/// first); memory for the surface, and 8 bytes for every 512 voxels.
SurfaceMesh carved_solid(std::span<const PosedImage> images, const CarvingLattice& lattice,
                         std::optional<double> ground_height_m = std::nullopt, const Monitor& monitor = {});

}  // namespace sarnerf
