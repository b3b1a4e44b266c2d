// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sarnerf::test {

/// Rows of the table in docs/results/extreme.md; their texts are in matrix.cpp.
enum class Case {
  // Sampling core.
  mixed_depths,
  one_without_the_other,
  jumps,
  long_rays,
  denormals,
  overflow,
  oracle,
  adjoint,
  adjoint_behind_opaque,
  field_values,
  // Geometry.
  positions,
  segment_points,
  projection,
  ground_angles,
  ray_origins,
  roof,
  wall,
  ground,
  nadir,
  horizon,
  layers,
  image_sizes,
  image_sizes_voxels,
  anisotropic,
  reach,
  voxel_planes,
  voxel_reach,
  media,
  voxel_media,
  // Meshes.
  map_coordinates,
  sizes,
  slivers,
  coincident,
  nested,
  inside_out,
  thin,
  rounded_files,
  many_pieces,
  small_pieces,
  many_solids,
  many_voxel_pieces,
  // Sentinel.
  count
};

/// Takes part in the table: of all errors recorded for a row, the largest counts. One that is not finite counts
/// as infinite.
void record(Case row, double error);

}  // namespace sarnerf::test
