// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/geometry/acquisition.h"
#include "surface/slice.h"

namespace sarnerf {

/// How much coarser, in either direction, the sampling is that a view contains: every third ray of every third
/// slice. Three, because the middle one of three slices lies in the middle of what it stands for, so that this is
/// the sampling itself and not one like it. It tells a view how far it has converged without another ray.
inline constexpr int kCoarser = 3;

/// What a slice of a row stands for in the coarser sampling of that row.
struct SliceGroup {
  int n_slices = 0;    ///< as many; 0: the slice is not part of the coarser sampling
  double shift = 0.0;  ///< from the slice's centre to the group's, in slices
};

/// Appends the groups of n neighbouring slices: threes, and pairs if their number is not divisible. The centre of
/// a pair lies half a slice to either side in turn, so that the shift, which the deposit undoes on
/// planes, cancels on outlines. A slice that is left over stands for itself.
void append_groups(int n_slices, std::vector<SliceGroup>& groups);

/// A slice's samples as a coarser level sees them: every k_step-th, each standing for k_step rays and the
/// group's slices; and what is left behind the last whole step, at the slice's own spacing. Either may
/// be empty: n_rays < 0.
struct SliceSubset {
  Slice steps, rest;
  void take(const Slice& slice, int k_step, const SliceGroup& group);
};

/// One slice of an azimuth row.
struct RowSlice {
  double along_m = 0.0;  ///< along-track coordinate of its middle
  double width_m = 0.0;
  double weight = 1.0;   ///< its width in widths of a row's equal slices
};

/// How rows are cut into slices: equally, but, where only a few corners of the mesh lie in a row, at these
/// corners, too. Between them everything a slice meets changes linearly along track, which its deposit
/// integrates exactly; a slice with a corner inside would count all or nothing of a face that ends there. Not exactly
/// linear is what hides what, so that there are at least three slices between corners that are few.
class RowSlices {
 public:
  /// `vertices_m`: of opaque matter, relative to `origin_from_aim_m`, world axes.
  RowSlices(const Acquisition& acquisition, int n_sub_rows, std::span<const glm::vec3> vertices_m,
            const glm::dvec3& origin_from_aim_m);

  /// The slices of row i in ascending order. `groups` of the same length get what each stands for in a sampling
  /// of half as many.
  void row(int i, std::vector<RowSlice>& slices, std::vector<SliceGroup>& groups) const;

 private:
  Acquisition acquisition_;
  int n_sub_rows_;
  std::vector<double> corners_m_;  ///< along-track coordinates, ascending; empty where there are too many
};

}  // namespace sarnerf
