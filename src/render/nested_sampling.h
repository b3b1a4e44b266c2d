// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "slice.h"

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

}  // namespace sarnerf
