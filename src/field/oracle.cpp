// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/field_sampler.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "check_field.h"

namespace sarnerf::oracle {
namespace {

/// Calls visit(weight, channels of the voxel) for the corners of a point's cell that lie in bricks. Points must be
/// finite and within 2³¹ voxels.
template <class T, class Visit>
void for_each_corner(const BrickView<T>& grid, const glm::dvec3& point_m, Visit&& visit) {
  const glm::dvec3 index = grid.transform.index_from_world(point_m);
  const glm::dvec3 low = glm::floor(index);
  const glm::dvec3 fraction = index - low;
  for (int n = 0; n < 8; ++n) {
    const glm::ivec3 step(n >> 2 & 1, n >> 1 & 1, n & 1);
    const glm::ivec3 voxel = glm::ivec3(low) + step;
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      weight *= step[axis] ? fraction[axis] : 1.0 - fraction[axis];
    }
    const std::uint32_t brick = grid.topology->find(brick_of_voxel(voxel));
    if (brick != kNoBrick) visit(weight, grid.voxel(brick, offset_in_brick(voxel)));
  }
}

/// The ray of each point.
std::vector<std::uint32_t> ray_of_points(const RayDirections& rays, std::size_t n_points) {
  std::vector<std::uint32_t> ray(n_points);
  for (std::size_t q = 0; q < rays.ray_direction.size(); ++q) {
    for (std::size_t s = rays.ray_begin[q]; s < rays.ray_begin[q + 1]; ++s) {
      ray[s] = static_cast<std::uint32_t>(q);
    }
  }
  return ray;
}

double source(const FieldChannels& channels, const double* c, const glm::dvec3& d) {
  if (channels.basis == SourceBasis::scattering) return std::max(0.0, c[0]);
  if (channels.basis == SourceBasis::cosine) {
    const glm::dvec3 normal(c[1], c[2], c[3]);
    const double length = glm::length(normal);
    const double cosine = length > 0.0 ? std::abs(glm::dot(normal, d)) / length : 0.0;
    return std::max(0.0, c[0]) * std::pow(cosine, std::max(0.0, c[4]));
  }
  const auto y = spherical_harmonics(d, channels.harmonics_degree);
  double sum = 0.0;
  for (int m = 0; m < channels.n_source(); ++m) sum += c[m] * y[static_cast<std::size_t>(m)];
  return std::max(0.0, sum);
}

}  // namespace

void sample_trilinear(const BrickView<const double>& grid, std::span<const glm::dvec3> points_m,
                      std::span<double> samples) {
  check_samples(grid, points_m.size(), samples.size());
  const auto n_channels = static_cast<std::size_t>(grid.n_channels);
  std::fill(samples.begin(), samples.end(), 0.0);
  for (std::size_t s = 0; s < points_m.size(); ++s) {
    for_each_corner(grid, points_m[s], [&](double weight, const double* voxel) {
      for (std::size_t c = 0; c < n_channels; ++c) samples[s * n_channels + c] += weight * voxel[c];
    });
  }
}

void scatter_trilinear(const BrickView<double>& grid_gradients,
                       std::span<const glm::dvec3> points_m,
                       std::span<const double> sample_gradients) {
  check_samples<double>(grid_gradients, points_m.size(), sample_gradients.size());
  const auto n_channels = static_cast<std::size_t>(grid_gradients.n_channels);
  for (std::size_t s = 0; s < points_m.size(); ++s) {
    for_each_corner(grid_gradients, points_m[s], [&](double weight, double* voxel) {
      for (std::size_t c = 0; c < n_channels; ++c) {
        voxel[c] += weight * sample_gradients[s * n_channels + c];
      }
    });
  }
}

void sample_field(const BrickView<const double>& grid, const FieldChannels& channels,
                  std::span<const glm::dvec3> points_m, const RayDirections& rays,
                  const FieldPoints<double>& out) {
  const std::size_t n = points_m.size();
  check_field(grid.n_channels, channels, rays, n, out);
  const auto n_channels = static_cast<std::size_t>(grid.n_channels);
  const auto first = static_cast<std::size_t>(channels.first_source());
  std::vector<double> samples(n * n_channels);
  sample_trilinear(grid, points_m, samples);
  const std::vector<std::uint32_t> ray = ray_of_points(rays, n);
  for (std::size_t s = 0; s < n; ++s) {
    const double* sample = &samples[s * n_channels];
    const glm::dvec3 d(rays.ray_direction[ray[s]]);
    out.extinction_per_m[s] = sample[0];
    if (channels.two_extinctions) out.extinction_back_per_m[s] = sample[1];
    out.source[s] = source(channels, sample + first, d);
  }
}

void sample_field_adjoint(const BrickView<double>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::dvec3> points_m, const RayDirections& rays,
                          std::span<const double> brightness,
                          const FieldPoints<const double>& point_gradients) {
  const std::size_t n = points_m.size();
  expect_harmonics(channels);
  check_field(grid_gradients.n_channels, channels, rays, n, point_gradients);
  expect_field_length(brightness.size(), n, "brightness");
  const auto n_channels = static_cast<std::size_t>(grid_gradients.n_channels);
  const auto first = static_cast<std::size_t>(channels.first_source());
  std::vector<double> sample_gradients(n * n_channels, 0.0);
  const std::vector<std::uint32_t> ray = ray_of_points(rays, n);
  for (std::size_t s = 0; s < n; ++s) {
    double* gradient = &sample_gradients[s * n_channels];
    const auto y =
        spherical_harmonics(glm::dvec3(rays.ray_direction[ray[s]]), channels.harmonics_degree);
    gradient[0] = point_gradients.extinction_per_m[s];
    if (channels.two_extinctions) gradient[1] = point_gradients.extinction_back_per_m[s];
    for (std::size_t m = first; m < n_channels && brightness[s] > 0.0; ++m) {
      gradient[m] = point_gradients.source[s] * y[m - first];
    }
  }
  scatter_trilinear(grid_gradients, points_m, sample_gradients);
}

}  // namespace sarnerf::oracle
