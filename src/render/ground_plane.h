// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "appearance.h"
#include "slice.h"
#include "view_rays.h"

namespace sarnerf {

/// The infinite ground as one view sees it. Its range depends on the ray angle alone, so one table
/// serves every row; and where no ray of the mesh comes near it, its image is known in closed form.
class GroundPlane {
 public:
  GroundPlane(const ViewRays& rays, const Appearance& appearance, double height_m);

  const Appearance& appearance() const { return appearance_; }

  /// Whether the plane looks the same everywhere, so that it needs no rays of its own.
  bool uniform() const { return !appearance_.checker; }

  /// Puts the ground into all samples of a traced slice that see nothing nearer, ends included.
  void fill(Slice& slice) const;

  /// Makes a slice that meets nothing but the ground: rays [first, first + n) and both ends. Its along_m
  /// and width_m must be set.
  void fill_alone(int first, int n, Slice& slice) const;

  /// Adds what a uniform ground gives outside the ray indices [gap_first, gap_last], in units of γ
  /// times ray steps like deposit_slice(), times `weight`. An empty gap (first ≥ last) means everywhere.
  void deposit_outside(double gap_first, double gap_last, double weight, std::span<double> bins) const;

 private:
  std::size_t index(int k) const { return static_cast<std::size_t>(k + 1); }
  void put(Slice& slice, std::size_t m, int k) const;

  const ViewRays& rays_;
  Appearance appearance_;
  std::vector<float> bin_, bin_per_ray_, gamma_;  ///< [n_el + 2], from k = −1
  std::vector<float> coplanar_bins_;              ///< [n_el + 2] how far nearer the ground still loses to a mesh
  std::vector<double> border_ray_;                ///< [n_range + 1] ray index at each bin border
  std::vector<double> bin_gamma_;                 ///< [n_range] mean γ over the bin's angles
};

}  // namespace sarnerf
