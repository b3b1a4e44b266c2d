// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "nested_sampling.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

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
