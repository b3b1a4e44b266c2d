// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

struct Model;  // sarnerf/nerf/model_file.h, which needs LibTorch

/// What the occupancy and the mesh of an extraction are made of.
enum class Body {
  solid,  ///< surfaces that views see, and all behind them: nobody sees inside of opaque matter
  shell,  ///< matter denser than a threshold, where it is
};

struct ExtractOptions {
  /// Voxels along the side of a cube of `extent_m`; 0: the learned lattice of the field `grid`, and voxels as large as a
  /// third of the cache's for `mlp`, over all that the field holds.
  int resolution = 256;
  double extent_m = 20.0;
  std::optional<glm::dvec3> centre_m;  ///< of the cube, world; else over the aim point, around matter; near its bottom if it is higher
  Body body = Body::solid;
  std::optional<double> threshold_per_m;   ///< one-way extinction of voxels that count as matter; else by its histogram
  std::optional<double> ground_height_m;   ///< world; the body ends there. Else at the model's level ground, or where returns end
  std::size_t most_views = 66;             ///< of the training's that tell the solid from what is empty
  std::uint64_t max_memory_bytes = 0;      ///< of grids, and of what views see; 0: unlimited
  std::string model_sha256;                ///< for the volume's provenance
  Monitor monitor;
};

/// What extract() is going to do.
struct ExtractionPlan {
  double voxel_size_m = 0.0;
  Box box_m;                      ///< world, of what is extracted
  double part_outside = 0.0;      ///< of the learned matter's box, by volume, that the extent cuts off
  std::size_t n_views = 0;        ///< that tell the solid from what is empty
  std::vector<std::string> grids; ///< of the volume
  std::size_t n_voxels = 0;       ///< of bricks in which the field may hold matter: no grid has more
  std::uint64_t voxel_bytes = 0;  ///< about, while it works: of these in all channels, before and as grids
  std::uint64_t view_bytes = 0;   ///< about: of what the views see
};

/// Throws UsageError for whatever extract() refuses before it has looked into the field. Cost: that of the field's values.
ExtractionPlan plan_extraction(const Model& model, const ExtractOptions& options);

/// A model as voxels and as a surface.
struct Extraction {
  VdbScene volume;   ///< world coordinates; the field as it was learned, and the occupancy of the body
  SurfaceMesh mesh;  ///< of the occupancy at one half, world coordinates
  double voxel_size_m = 0.0;
  Box box_m;                            ///< world, of what was extracted
  double threshold_per_m = 0.0;         ///< that was used, or would be: see ExtractOptions
  double bottom_m = 0.0;                ///< world height at which the body ends
  bool bottom_was_given = false;
  double agreeing_share = 0.0;          ///< of the views that hold a place: so many had to see it empty; 0 for a shell
  double harmonics_residual = 0.0;      ///< of the field `mlp`: see docs/method/extraction.md
  double part_outside = 0.0;            ///< of the learned matter's box, by volume, that the extent cuts off
  struct Seconds {
    double field = 0.0, body = 0.0, mesh = 0.0;
  } seconds;
};

/// Takes a learned field out of its model: extinction and brightness as they were learned, the body that its training
/// views see, and its surface. Throws UsageError for a field without matter, an extent that misses it or has voxels larger
/// than half of it, a ground above it or farther below it than it is high, a threshold that leaves nothing, or more memory
/// than allowed; Interrupted. Cost: docs/method/extraction.md.
Extraction extract(const Model& model, const ExtractOptions& options);

/// The threshold between fog and matter by Otsu's method (1979) on the logarithm of extinctions above 0: that which
/// parts them into two classes of the least variance within. 0 without any.
double otsu_threshold(std::vector<float> extinction_per_m);

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
