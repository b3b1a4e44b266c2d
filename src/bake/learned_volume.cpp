// SPDX-License-Identifier: Apache-2.0
#include "learned_volume.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/field/trilinear.h"

namespace sarnerf {
namespace {

bool before(const glm::ivec3& a, const glm::ivec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

void require_memory(std::size_t n_bricks, const FieldChannels& channels, double voxel_size_m, std::uint64_t max_memory_bytes) {
  // Bricks, and the grids that are made of them.
  const std::uint64_t needed = 2 * volume_bytes(n_bricks, channels);
  if (max_memory_bytes == 0 || needed <= max_memory_bytes) return;
  // Matter is a layer: twice as large voxels need a quarter of the memory.
  const double larger = voxel_size_m * std::sqrt(static_cast<double>(needed) / static_cast<double>(max_memory_bytes));
  throw UsageError(format("about %.0f MiB are needed for voxels of %.3g m, more than --max-memory allows (%.0f MiB left); "
                          "voxels of %.2g m would do (--resolution)",
                          static_cast<double>(needed) / 1048576.0, voxel_size_m,
                          static_cast<double>(max_memory_bytes) / 1048576.0, 1.1 * larger));
}

}  // namespace

std::uint64_t volume_bytes(std::size_t n_bricks, const FieldChannels& channels) {
  return std::uint64_t{n_bricks} * kBrickVoxels * sizeof(float) * static_cast<std::uint64_t>(channels.count());
}

LearnedVolume native_volume(const GridField& field) {
  LearnedVolume volume{BrickGrid<float>(field.transform(), field.channels().count()), field.channels(), 0.0};
  const BrickTopology& topology = field.topology();
  volume.grid.reserve_bricks(topology.n_bricks());
  for (std::uint32_t b = 0; b < topology.n_bricks(); ++b) volume.grid.touch_brick(topology.coordinate(b));
  const std::vector<float> values = field.values();
  std::copy(values.begin(), values.end(), volume.grid.view().values.begin());
  return volume;
}

std::vector<glm::ivec3> bricks_with_matter(const Occupancy& occupancy, const GridTransform& of_occupancy,
                                           const VoxelLattice& lattice) {
  const glm::ivec3 first = brick_of_voxel(lattice.first), last = brick_of_voxel(lattice.last);
  std::vector<glm::ivec3> bricks;
  for (std::uint32_t b = 0; b < occupancy.bricks().n_bricks(); ++b) {
    const Occupancy::CellBox cells = occupancy.cell_box(b);
    const glm::ivec3 origin = occupancy.bricks().coordinate(b) * kBrickSide;
    const auto index_of = [&](const glm::ivec3& corner) {
      return lattice.transform.index_from_world(of_occupancy.world_from_index(glm::dvec3(origin + corner)));
    };
    const glm::ivec3 low = glm::max(first, brick_of_voxel(glm::ivec3(glm::floor(index_of(cells.first)))));
    const glm::ivec3 high = glm::min(last, brick_of_voxel(glm::ivec3(glm::ceil(index_of(cells.last + 1)))));
    for (int x = low.x; x <= high.x; ++x)
      for (int y = low.y; y <= high.y; ++y)
        for (int z = low.z; z <= high.z; ++z) bricks.emplace_back(x, y, z);
  }
  std::sort(bricks.begin(), bricks.end(), before);
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

LearnedVolume empty_volume(const VoxelLattice& lattice, const FieldChannels& channels, std::span<const glm::ivec3> bricks,
                           std::uint64_t max_memory_bytes) {
  require_memory(bricks.size(), channels, lattice.transform.voxel_size_m, max_memory_bytes);
  LearnedVolume volume{BrickGrid<float>(lattice.transform, channels.count()), channels, 0.0};
  volume.grid.reserve_bricks(bricks.size());
  for (const glm::ivec3& brick : bricks) volume.grid.touch_brick(brick);
  return volume;
}

LearnedVolume resampled(const LearnedVolume& volume, const VoxelLattice& lattice, std::uint64_t max_memory_bytes,
                        const Monitor& monitor) {
  const std::vector<glm::ivec3> bricks = bricks_with_matter(volume.occupancy(), volume.grid.transform(), lattice);
  const int n_channels = volume.channels.count();
  LearnedVolume result = empty_volume(lattice, volume.channels, bricks, max_memory_bytes);
  result.harmonics_residual = volume.harmonics_residual;
  const BrickView<float> out = result.grid.view();
  const std::size_t per_brick = std::size_t{kBrickVoxels} * static_cast<std::size_t>(n_channels);
  parallel_for(bricks.size(), 16, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    TrilinearSampler sampler(volume.grid.view());
    std::vector<glm::vec3> points_m(kBrickVoxels);
    for (std::size_t b = begin; b < end; ++b) {
      for (int v = 0; v < kBrickVoxels; ++v) {
        const glm::ivec3 voxel = bricks[b] * kBrickSide + voxel_in_brick(v);
        points_m[static_cast<std::size_t>(v)] = glm::vec3(lattice.transform.world_from_index(glm::dvec3(voxel)));
      }
      const std::span<float> values = out.values.subspan(b * per_brick, per_brick);
      sampler.sample(points_m, values);
      for (int v = 0; v < kBrickVoxels; ++v) {
        const glm::ivec3 voxel = bricks[b] * kBrickSide + voxel_in_brick(v);
        float* const value = &values[static_cast<std::size_t>(v * n_channels)];
        // As in the paper: what does not attenuate is not there, whatever its brightness.
        if (!lattice.holds(voxel) || value[0] <= 0.0f) std::fill(value, value + n_channels, 0.0f);
      }
    }
  });
  return result;
}

}  // namespace sarnerf
