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

/// The surface of the field `surface` where no view sees it. Both explain all images equally.
enum class Unseen {
  membrane,  ///< spanned between seen parts, within the hull
  hull,      ///< as large as the views allow
};

struct ExtractOptions {
  /// Voxels along the side of a cube of `extent_m`. 0: all occupied voxels, on the learned lattice of the fields `grid` and
  /// `surface`, or for `mlp` on voxels a third as wide as the cache's.
  int resolution = 256;
  double extent_m = 20.0;
  /// Centre of the cube, world. Default: over the aim point, around the occupied voxels, or near their bottom if they are
  /// taller than the cube.
  std::optional<glm::dvec3> centre_m;
  /// Least one-way extinction (1/m) of the body. Default: Otsu's. The field `surface` has none.
  std::optional<double> threshold_per_m;
  std::optional<double> ground_height_m;   ///< world, bottom of the body. Default: the model's ground, if it has one
  std::optional<Unseen> unseen;            ///< Default: the hull where a ground bounds it, else a membrane
  std::uint64_t max_memory_bytes = 0;      ///< of the grids; 0: unlimited
  std::string model_sha256;                ///< for the volume's provenance
  Monitor monitor;
};

/// What extract() is going to do.
struct ExtractionPlan {
  double voxel_size_m = 0.0;
  Box box_m;                      ///< world, of the extracted volume
  double part_outside = 0.0;      ///< fraction of the occupied voxels' box, by volume, that the extent cuts off
  std::vector<std::string> grids; ///< of the volume
  std::size_t n_voxels = 0;       ///< of bricks that may be occupied: upper bound for every grid
  std::uint64_t voxel_bytes = 0;  ///< approximate, during extraction: of all channels, as bricks and as grids
};

/// Throws UsageError for all that extract() rejects before it evaluates the field. Cost: at most a copy of the field's values.
ExtractionPlan plan_extraction(const Model& model, const ExtractOptions& options);

/// A model as voxels and as a surface.
struct Extraction {
  bool is_surface = false;  ///< of the field `surface`; the others are fog
  VdbScene volume;   ///< world coordinates; the field as it was learned, and the occupancy of the body
  SurfaceMesh mesh;  ///< of the occupancy at one half, world coordinates
  double voxel_size_m = 0.0;
  Box box_m;                            ///< world, of the extracted volume
  double threshold_per_m = 0.0;         ///< of the body: that of ExtractOptions, else Otsu's; 0 for `surface`
  double bottom_m = 0.0;                ///< world height of the body's bottom
  std::optional<double> floor_m;        ///< world height at which the body was cut: the one given, or the learned ground
  double harmonics_residual = 0.0;      ///< of the field `mlp`: see docs/method/extraction.md
  std::size_t n_components = 0;         ///< of the field `surface`: closed surfaces as contoured
  /// Of the field `surface`: length, width and height of the component with the largest area, from the 1st to the 99th percentile
  /// of its area along its own horizontal axes and vertically.
  glm::dvec3 largest_component_m{0.0};
  std::size_t n_unseen_components = 0;  ///< of them, those that no view sees, which were removed
  double unseen_part = 0.0;             ///< of the field `surface`: fraction of the mesh's vertices that no view sees
  double part_outside = 0.0;            ///< fraction of the occupied voxels' box, by volume, that the extent cuts off
  struct Seconds {
    double field = 0.0, body = 0.0, mesh = 0.0;
  } seconds;
};

/// Extracts a learned field from its model: extinction and brightness as they were learned, the body, and the body's surface.
/// The body of the field `surface` is where its distance is below 0. The volume then is opaque below that level. The
/// fields `grid` and `mlp` are fog: their body is where extinction reaches a threshold, of the voxels that carving left
/// before the training, and it is hollow where no view sees into an opaque object.
///
/// Throws UsageError for a field without occupied voxels, an extent that misses them or has voxels wider than half of their
/// box, a ground above them or farther below them than they are high, a threshold that leaves nothing, or more memory
/// than allowed; Interrupted. Cost: docs/method/extraction.md.
Extraction extract(const Model& model, const ExtractOptions& options);

/// Otsu's threshold (1979) between fog and opaque material, on the logarithm of extinctions above 0. It separates them into
/// two classes with the least variance within each class. 0 for an empty vector.
double otsu_threshold(std::vector<float> extinction_per_m);

/// Cubic voxels that fill a box, the first one in its lowest corner; the last ones may extend beyond it.
struct CarvingLattice {
  Box box_m;  ///< in the frame of the acquisitions' aim points
  double voxel_size_m = 0.0;
};

/// The solid that remains when all voxels are removed that some view shows to be empty: the baseline that any
/// reconstruction should beat. A voxel is empty if its centre is nearer to some view's radar than the first return of its
/// azimuth row, the near edge of the first pixel above a millionth of the brightest pixel of all images. There is no margin
/// and no smoothing, and neighbouring rows are not tested. A row without any return is empty in its whole swath. Points in
/// no view's swath, and points below `ground_height_m`, are empty, too.
///
/// Everything is in one frame, that of the acquisitions' aim points: world coordinates for images as load_images()
/// gives them, relative to the aim point for those of a TrainingSet, whose aim is the origin.
///
/// Returns the closed surface half-way between full and empty centres, by level_surface(); an empty mesh
/// if nothing remains, as without images. Throws UsageError for an empty box, a voxel size that is not above 0 or
/// more than 8192 voxels along a side; GeometryError for an impossible acquisition; Interrupted. Cost: 7 ns for each
/// remaining voxel and view on one thread, and little for others (the view that emptied the last voxel is tested
/// first); memory for the surface, and 8 bytes for every 512 voxels.
SurfaceMesh carved_solid(std::span<const PosedImage> images, const CarvingLattice& lattice,
                         std::optional<double> ground_height_m = std::nullopt, const Monitor& monitor = {});

}  // namespace sarnerf
