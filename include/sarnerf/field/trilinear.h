// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// Trilinear interpolation of all channels at points, 0 where there is no brick.
///
/// `points_m` [n_points] in the frame of the grid's transform; `samples` [n_points × n_channels]. A
/// point that is not finite, or beyond the voxels that bricks can hold, samples 0. Indices are formed in
/// double, so that precision does not depend on how large a scene is; the rest is float32. Throws
/// UsageError where lengths do not fit. Cost: a brick look-up and eight voxels; 30 ns with one channel, 36
/// with five, on one thread of a 2.5 GHz Xeon with a busy neighbour and the voxels in cache.
void sample_trilinear(const BrickView<const float>& grid, std::span<const glm::vec3> points_m,
                      std::span<float> samples);

/// The same for many small sets of points: remembers where it was. One per thread; the grid must outlive it
/// and not change meanwhile.
class TrilinearSampler {
 public:
  explicit TrilinearSampler(const BrickView<const float>& grid);
  void sample(std::span<const glm::vec3> points_m, std::span<float> samples);

 private:
  using Sample = void (*)(const BrickView<const float>&, BrickFinder&, std::span<const glm::vec3>,
                          const float* zeros, float* out);
  BrickView<const float> grid_;
  BrickFinder finder_;
  std::vector<float> zeros_;  ///< stand for voxels of bricks that are not there
  Sample sample_;
};

/// Adjoint of sample_trilinear(): adds to `grid_gradients` what ∂L/∂samples [n_points × n_channels] means
/// for the voxels. What falls outside of the bricks is dropped. Several threads need values of their own,
/// or bricks that they do not share.
void scatter_trilinear(const BrickView<float>& grid_gradients, std::span<const glm::vec3> points_m,
                       std::span<const float> sample_gradients);

}  // namespace sarnerf
