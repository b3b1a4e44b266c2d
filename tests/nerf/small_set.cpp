// SPDX-License-Identifier: Apache-2.0
#include "small_set.h"

#include <numbers>

#include "small_grid.h"

namespace sarnerf {

TrainingSet small_set(int n_views) {
  const GridField truth = small_grid(31);
  std::vector<PosedImage> images;
  for (int n = 0; n < n_views; ++n) {
    const Acquisition a = small_acquisition(2.0 * std::numbers::pi * n / n_views);
    images.push_back({"view_" + std::to_string(n), a, render_view(truth, a)});
  }
  return training_set(std::move(images), {glm::dvec3(-3.0, -2.0, -3.0), glm::dvec3(3.0, 2.0, 3.0)});
}

TrainerOptions small_options(const TrainingSet& set) {
  TrainerOptions options = default_options(set, "grid");
  options.grid.voxel_size_m = 0.4;
  options.rows_per_step = 12;
  options.grid.level_steps = 5;
  options.grid.refine_steps_left = 10;
  return options;
}

}  // namespace sarnerf
