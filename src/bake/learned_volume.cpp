// SPDX-License-Identifier: Apache-2.0
#include "learned_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/mlp_field.h"

namespace sarnerf {

namespace {

bool before(const glm::ivec3& a, const glm::ivec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

}  // namespace

void require_memory(std::uint64_t needed, double voxel_size_m, std::uint64_t max_memory_bytes) {
  if (max_memory_bytes == 0 || needed <= max_memory_bytes) return;
  // Occupied voxels form a layer: twice as large voxels need a quarter of the memory.
  const double larger = voxel_size_m * std::sqrt(static_cast<double>(needed) / static_cast<double>(max_memory_bytes));
  throw UsageError(format("about %.0f MiB are needed for voxels of %.3g m, and %.0f MiB are left of --max-memory; "
                          "voxels of %.2g m would do (--resolution)",
                          static_cast<double>(needed) / 1048576.0, voxel_size_m,
                          static_cast<double>(max_memory_bytes) / 1048576.0, 1.1 * larger));
}

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
  // Bricks, and the grids that are made of them.
  require_memory(2 * volume_bytes(bricks.size(), channels), lattice.transform.voxel_size_m, max_memory_bytes);
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
        // As in the paper, a voxel without extinction is empty, whatever its brightness.
        if (!lattice.holds(voxel) || value[0] <= 0.0f) std::fill(value, value + n_channels, 0.0f);
      }
    }
  });
  return result;
}

namespace {

constexpr int kDegree = 2;
constexpr std::size_t kDirections = 12;  ///< more than there are harmonics
constexpr std::size_t kChunk = 1 << 15;  ///< points per evaluation of the network

/// Two-way optical depth per reference bin below which a voxel is left empty.
constexpr double kLeastDepth = 0.01;

/// Up to kDirections directions of the views, each the farthest from those before it.
std::vector<glm::vec3> spread_directions(std::span<const Acquisition> views) {
  std::vector<glm::dvec3> all;
  for (const Acquisition& view : views) all.push_back(radar_frame(view).k);
  std::vector<glm::vec3> chosen;
  std::vector<double> nearest(all.size(), -2.0);  // cosine to the nearest chosen one
  std::size_t next = 0;
  while (chosen.size() < std::min(kDirections, all.size())) {
    chosen.emplace_back(all[next]);
    for (std::size_t n = 0; n < all.size(); ++n) nearest[n] = std::max(nearest[n], glm::dot(all[n], all[next]));
    next = static_cast<std::size_t>(std::min_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  return chosen;
}

/// Matrix [n_harmonics × n_directions] from brightness in the directions to the least-squares coefficients. The normal
/// equations are regularised by a ridge term, so that coefficients that the directions do not determine stay small.
std::vector<double> fit_matrix(std::span<const glm::vec3> directions) {
  constexpr std::size_t kN = n_harmonics(kDegree);
  constexpr double kRidge = 1e-4;
  std::array<std::array<double, 2 * kN>, kN> m{};  // normal equations beside the unit matrix
  std::vector<std::array<double, kMaxHarmonics>> y;
  for (const glm::vec3& d : directions) y.push_back(spherical_harmonics(glm::normalize(glm::dvec3(d)), kDegree));
  for (std::size_t r = 0; r < kN; ++r) {
    for (std::size_t c = 0; c < kN; ++c)
      for (const auto& row : y) m[r][c] += row[r] * row[c] / static_cast<double>(y.size());
    m[r][r] += kRidge;
    m[r][kN + r] = 1.0;
  }
  for (std::size_t p = 0; p < kN; ++p) {  // positive definite: no pivoting is needed
    const double inverse = 1.0 / m[p][p];
    for (double& x : m[p]) x *= inverse;
    for (std::size_t r = 0; r < kN; ++r) {
      if (r == p) continue;
      const double factor = m[r][p];
      for (std::size_t c = 0; c < 2 * kN; ++c) m[r][c] -= factor * m[p][c];
    }
  }
  std::vector<double> fit(kN * y.size());
  for (std::size_t l = 0; l < kN; ++l)
    for (std::size_t d = 0; d < y.size(); ++d)
      for (std::size_t c = 0; c < kN; ++c)
        fit[l * y.size() + d] += m[l][kN + c] * y[d][c] / static_cast<double>(y.size());
  return fit;
}

}  // namespace

FieldChannels sampled_channels() { return {false, kDegree, SourceBasis::harmonics}; }

LearnedVolume sampled(const MlpField& field, const VoxelLattice& lattice, std::span<const Acquisition> views,
                      std::uint64_t max_memory_bytes, const Monitor& monitor) {
  const OccupancyGrid& cache = field.cache();
  const std::vector<glm::ivec3> bricks = bricks_with_matter(cache.occupancy(), cache.transform(), lattice);
  const FieldChannels channels = sampled_channels();
  const int n_channels = channels.count();
  LearnedVolume volume = empty_volume(lattice, channels, bricks, max_memory_bytes);
  const BrickView<float> out = volume.grid.view();

  // Voxels in occupied cells of the field's cache. Elsewhere the field is empty by definition.
  std::vector<std::size_t> places;
  BrickFinder finder(cache.occupancy().bricks());
  const auto voxel_at = [&](std::size_t place) { return bricks[place / kBrickVoxels] * kBrickSide + voxel_in_brick(place); };
  const auto place_m = [&](std::size_t place) {
    return lattice.transform.world_from_index(glm::dvec3(voxel_at(place)));
  };
  for (std::size_t place = 0; place < bricks.size() * kBrickVoxels; ++place) {
    if (!lattice.holds(voxel_at(place))) continue;
    const glm::ivec3 cell = glm::ivec3(glm::floor(cache.transform().index_from_world(place_m(place))));
    const std::uint32_t brick = finder.find(brick_of_voxel(cell));
    if (brick != kNoBrick && cache.occupancy().cell(brick, cell)) places.push_back(place);
  }

  const std::vector<glm::vec3> directions = spread_directions(views);
  const std::vector<double> fit = fit_matrix(directions);
  const torch::NoGradGuard no_gradients;
  const auto least = static_cast<float>(kLeastDepth / (2.0 * field.units().reference_bin_m));
  double square = 0.0, square_residual = 0.0;
  for (std::size_t first = 0; first < places.size(); first += kChunk) {
    monitor.check();
    monitor.report("evaluating the network", first, places.size());
    const std::span some = std::span(places).subspan(first, std::min(kChunk, places.size() - first));
    std::vector<glm::vec3> points_m;
    for (const std::size_t place : some) points_m.emplace_back(place_m(place));
    std::vector<std::uint32_t> one_ray{0, static_cast<std::uint32_t>(points_m.size())};
    const MlpField::Values once = field.evaluate(points_m, std::span(directions).first(1), one_ray);
    const float* const extinction = once.extinction_per_m.data_ptr<float>();
    std::vector<std::size_t> matter;
    std::vector<glm::vec3> matter_m;
    for (std::size_t n = 0; n < some.size(); ++n) {
      if (extinction[n] < least) continue;
      out.values[some[n] * static_cast<std::size_t>(n_channels)] = extinction[n];
      matter.push_back(some[n]);
      matter_m.push_back(points_m[n]);
    }
    if (matter.empty()) continue;
    // All points in one direction, then in the next.
    std::vector<torch::Tensor> brightness;
    one_ray[1] = static_cast<std::uint32_t>(matter_m.size());
    for (std::size_t d = 0; d < directions.size(); ++d)
      brightness.push_back(field.evaluate(matter_m, std::span(directions).subspan(d, 1), one_ray).brightness);
    for (std::size_t n = 0; n < matter.size(); ++n) {
      float* const value = &out.values[matter[n] * static_cast<std::size_t>(n_channels)];
      for (std::size_t l = 0; l < static_cast<std::size_t>(channels.n_source()); ++l) {
        double c = 0.0;
        for (std::size_t d = 0; d < directions.size(); ++d)
          c += fit[l * directions.size() + d] * double{brightness[d].data_ptr<float>()[n]};
        value[1 + l] = static_cast<float>(c);
      }
      for (std::size_t d = 0; d < directions.size(); ++d) {
        const auto y = spherical_harmonics(glm::normalize(glm::dvec3(directions[d])), kDegree);
        double fitted = 0.0;
        for (std::size_t l = 0; l < static_cast<std::size_t>(channels.n_source()); ++l)
          fitted += y[l] * double{value[1 + l]};
        const double truth = double{brightness[d].data_ptr<float>()[n]};
        const double difference = std::max(0.0, fitted) - truth;
        square_residual += double{value[0]} * difference * difference;
        square += double{value[0]} * truth * truth;
      }
    }
  }
  monitor.report("evaluating the network", places.size(), places.size());
  if (square > 0.0) volume.harmonics_residual = std::sqrt(square_residual / square);
  return volume;
}

}  // namespace sarnerf
