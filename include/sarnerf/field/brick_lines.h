// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// The bricks of a topology in the orders in which operations sweep through all of their voxels: as runs of neighbours along
/// each axis, which end where a brick is missing, and from one corner to the opposite one.
class BrickLines {
 public:
  explicit BrickLines(const BrickTopology& topology);

  std::size_t n_voxels() const { return n_voxels_; }
  /// Numbers of the bricks of each run, in ascending order along the axis.
  const std::vector<std::vector<std::uint32_t>>& runs(int axis) const { return runs_[static_cast<std::size_t>(axis)]; }

  /// Numbers of all bricks, so that each comes after its neighbours against `direction` (each component ±1).
  std::vector<std::uint32_t> in_order(const glm::ivec3& direction) const;
  /// Numbers of a brick's neighbours towards −x, +x, −y, +y, −z and +z; kNoBrick where there is none.
  const std::array<std::uint32_t, 6>& neighbours(std::uint32_t brick) const { return neighbours_[brick]; }

 private:
  std::size_t n_voxels_;
  std::array<std::vector<std::vector<std::uint32_t>>, 3> runs_;
  std::vector<glm::ivec3> coordinates_;
  std::vector<std::array<std::uint32_t, 6>> neighbours_;
};

/// Replaces values [n_voxels] by (1 − a ∂²)⁻¹ of them along each axis in turn, with a = `voxels2` in squares of a voxel, and 0
/// outside of the bricks: a low-pass filter of response Π 1/(1 + a k²), exact for a line without ends. Two exponentials a line
/// (a recursive filter), so the cost does not depend on a: about 10 ns a voxel on one thread.
void smooth(const BrickLines& lines, double voxels2, std::span<float> values);

/// Replaces `distance` [n_voxels], which is negative inside, by the distance in voxels to the surface where it changes its sign,
/// with the same signs, and at most `most`; `most` where no value changes its sign. A value of 0 counts as outside. Voxels with a
/// neighbour of the other sign get the distance to the plane that their slopes towards the surface define, which is exact where
/// values are linear. The others follow by fast sweeping (Zhao 2005): upwind differences of |∇f| = 1, once in each of eight
/// orders; distances to a plane are exact, those to curved surfaces a little too large. Serial; about 0.2 µs a voxel.
void redistance(const BrickLines& lines, float most, std::span<float> distance);

}  // namespace sarnerf
