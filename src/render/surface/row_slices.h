// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/geometry/acquisition.h"
#include "surface/slice.h"

namespace sarnerf {

/// Factor by which the coarser sampling contained in a view is coarser, in either direction: every third ray of every
/// third slice. Three, because the middle one of three slices lies at the group's centre: the subset is then exactly
/// the coarser sampling. A view compares itself with it to estimate its error without tracing another ray.
inline constexpr int kCoarser = 3;

/// The slices of a row that one slice represents in the coarser sampling of that row.
struct SliceGroup {
  int n_slices = 0;    ///< size of the group; 0: the slice is not part of the coarser sampling
  double shift = 0.0;  ///< from the slice's centre to the group's, in slices
};

/// Appends the groups of n neighbouring slices: threes, and pairs if n is not divisible by three. A pair's centre lies
/// half a slice from the slice that represents it, on alternating sides. The deposit corrects this shift on planes, and
/// on outlines it cancels. A single remaining slice represents itself.
void append_groups(int n_slices, std::vector<SliceGroup>& groups);

/// A slice's samples in a coarser level. `steps`: every k_step-th sample, which represents k_step rays of the
/// group's slices. `rest`: the samples behind the last whole step, at the slice's own spacing. Either may
/// be empty: n_rays < 0.
struct SliceSubset {
  Slice steps, rest;
  void take(const Slice& slice, int k_step, const SliceGroup& group);
};

/// One slice of an azimuth row.
struct RowSlice {
  double along_m = 0.0;  ///< along-track coordinate of its centre
  double width_m = 0.0;
  double weight = 1.0;   ///< its width over that of the row's equal slices
};

/// Cuts rows into slices: equally, and also at the corners of the mesh in rows that contain only a few of them. Between
/// corners the sections of faces change linearly along track, and the deposit integrates this exactly. A slice with a
/// corner inside would count all or nothing of a face that ends there. Occlusion does not change linearly; therefore
/// at least three slices lie between two corners in rows of few corners.
class RowSlices {
 public:
  /// `vertices_m`: of opaque faces, relative to `origin_from_aim_m`, world axes.
  RowSlices(const Acquisition& acquisition, int n_slices, std::span<const glm::vec3> vertices_m,
            const glm::dvec3& origin_from_aim_m);

  /// The slices of row i in ascending order. `groups`, of the same length, gets the group of each slice in a sampling
  /// kCoarser times coarser.
  void row(int i, std::vector<RowSlice>& slices, std::vector<SliceGroup>& groups) const;

 private:
  Acquisition acquisition_;
  int n_slices_;
  std::vector<double> corners_m_;  ///< along-track coordinates, ascending; empty where there are too many
};

}  // namespace sarnerf
