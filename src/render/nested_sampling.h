// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "slice.h"

namespace sarnerf {

/// What a slice of a row stands for in a coarser sampling of that row.
struct SliceGroup {
  int n_slices = 0;    ///< as many; 0: the slice is not part of the coarser sampling
  double shift = 0.0;  ///< from the slice's centre to the group's, in slices
};

/// A coarser sampling that is contained in a view's own: every `k_step`th ray of every other slice. It tells a
/// view how far it has converged without tracing another ray.
struct NestedLevel {
  int k_step = 2;
  std::vector<SliceGroup> groups;  ///< per slice of a row
  /// A row of a single slice has nothing coarser in it: its slice stands for the next row's instead.
  bool next_row = false;
};

/// Every k_step-th ray of half the slices of rows of `n_sub_rows`. Groups' centres lie on their slice, or half a
/// slice to either side in turn, so that the shift, which the deposit undoes on planes, cancels on outlines.
NestedLevel nested_level(int k_step, int n_sub_rows);

/// A slice's samples as a coarser level sees them: every k_step-th, each standing for k_step rays and the
/// group's slices; and what is left behind the last whole step, at the slice's own spacing. Either may
/// be empty: n_rays < 0.
struct SliceSubset {
  Slice steps, rest;
  void take(const Slice& slice, int k_step, const SliceGroup& group);
};

}  // namespace sarnerf
