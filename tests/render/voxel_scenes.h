// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/render/engine.h"
#include "sarnerf/scene/vdb_scene.h"
#include "scenes.h"

namespace sarnerf::test {

inline Volume voxels_of(const Scene& scene, double voxel_size_m) {
  VoxeliseOptions options;
  options.voxel_size_m = voxel_size_m;
  return to_volume(voxelise(scene, options));
}

inline Image<float> render_voxels(const Scene& scene, const Acquisition& view, double voxel_size_m,
                                  Sampling sampling = {}) {
  const VoxelEngine engine(scene, voxels_of(scene, voxel_size_m));
  return engine.render(engine.plan(view, sampling)).beta0;
}

inline Image<float> render_surface(const Scene& scene, const Acquisition& view, Sampling sampling = {}) {
  const SurfaceEngine engine(scene);
  return engine.render(engine.plan(view, sampling)).beta0;
}

/// A volume of constant matter where `inside` says so, and its scene.
template <class Inside>
Volume volume_where(double voxel_size_m, const Box& box, const std::vector<float>& channels,
                    const FieldChannels& layout, Inside&& inside) {
  Volume volume;
  volume.channels = layout;
  volume.grid = BrickGrid<float>({box.min, voxel_size_m}, layout.count());
  const glm::ivec3 n(glm::ceil(box.size() / voxel_size_m));
  for (int x = 0; x <= n.x; ++x) {
    for (int y = 0; y <= n.y; ++y) {
      for (int z = 0; z <= n.z; ++z) {
        const double part = inside(box.min + voxel_size_m * glm::dvec3(x, y, z));
        if (!(part > 0.0)) continue;
        const auto voxel = volume.grid.touch_voxel({x, y, z});
        for (std::size_t c = 0; c < voxel.size(); ++c) voxel[c] = static_cast<float>(part) * channels[c];
        ++volume.n_occupied_voxels;
      }
    }
  }
  volume.support_m = {box.min - voxel_size_m, box.max + 2.0 * voxel_size_m};
  volume.box_m = box;
  return volume;
}

/// Sum over bins of β⁰ Δr, in the row through the middle: what the rays of one row collect.
inline double collected(const Image<float>& image, const Acquisition& view) {
  double total = 0.0;
  for (int j = 0; j < view.n_range; ++j) total += image(view.n_azimuth / 2, j) * view.range_spacing_m;
  return total;
}

}  // namespace sarnerf::test
