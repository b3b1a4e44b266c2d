// SPDX-License-Identifier: Apache-2.0
#include "small_grid.h"

#include <cmath>
#include <random>

#include "sarnerf/mpa/volume_march.h"

namespace sarnerf {
namespace {

constexpr double kVoxel_m = 0.4;
constexpr double kGoldenRatio = 0.6180339887498949;

/// Where segments lie; values are LibTorch's business.
struct Ray {
  std::vector<glm::vec3> points_m;
  std::vector<double> length_m, near_bin;
  glm::vec3 direction;
};

std::vector<Ray> rays_of_row(const GridField& field, const RowRequest& request, const RaySampling& sampling,
                             double& step_rad) {
  const Acquisition& a = request.acquisition;
  const std::vector<float> values = field.values();
  VolumeMarcher marcher(field.view(values), field.channels(), field.occupancy(), sampling.longest_m,
                        sampling.end_depth);
  const Box box_m = field.occupied_box_m();
  const auto [first, last] = angular_extent(a, box_m);
  step_rad = sampling.ray_spacing_m / a.slant_range_m;
  const double first_ray = std::ceil(first / step_rad - request.fan_jitter);
  const int n = static_cast<int>(std::floor(last / step_rad - request.fan_jitter) - first_ray) + 1;
  const RayGrid grid(a, {(first_ray + request.fan_jitter - 0.5) * step_rad, step_rad, n});
  std::vector<Ray> rays;
  for (int m = 0; m < sampling.sub_rows; ++m) {
    for (int k = 0; k < n; ++k) {
      const double shifted = request.along_track_jitter + kGoldenRatio * (first_ray + k);
      const double place = shifted - std::floor(shifted);
      const double along_m = a.row_offset_m(request.row + (m + place) / sampling.sub_rows - 0.5);
      SampleBatch batch;
      BatchField sampled;
      const RangeInterval inside = clip_to_box(grid, along_m, k, box_m);
      if (inside.empty()) continue;
      const MarchRay ray{along_m, 0, k, inside};
      marcher.march(grid, {&ray, 1}, batch, sampled);
      if (batch.n_segments() == 0) continue;
      rays.push_back({batch.point_m, {batch.length_m.begin(), batch.length_m.end()}, sampled.near_bin,
                      batch.ray_direction[0]});
    }
  }
  return rays;
}

/// All channels at the points, [n_points, 1 + n_harmonics].
torch::Tensor interpolate(const GridField& field, const torch::Tensor& channels, std::span<const glm::vec3> points_m) {
  std::vector<std::int64_t> places;
  std::vector<double> weights;
  std::vector<std::int64_t> parameter_of(field.n_voxels(), -1);
  for (std::size_t n = 0; n < field.n_active(); ++n)
    parameter_of[field.active_voxels()[n]] = static_cast<std::int64_t>(n);
  const auto none = static_cast<std::int64_t>(field.n_active());  // a row of zeros behind the parameters
  for (const glm::vec3& p : points_m) {
    const glm::dvec3 at = field.transform().index_from_world(glm::dvec3(p));
    const glm::dvec3 low = glm::floor(at), f = at - low;
    for (int c = 0; c < 8; ++c) {
      const glm::ivec3 corner(c >> 2, c >> 1 & 1, c & 1);
      const glm::ivec3 voxel = glm::ivec3(low) + corner;
      const std::uint32_t brick = field.topology().find(brick_of_voxel(voxel));
      std::int64_t place = none;
      if (brick != kNoBrick) {
        const std::int64_t parameter =
            parameter_of[std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(voxel))];
        if (parameter >= 0) place = parameter;
      }
      places.push_back(place);
      double w = 1.0;
      for (int axis = 0; axis < 3; ++axis) w *= corner[axis] ? f[axis] : 1.0 - f[axis];
      weights.push_back(w);
    }
  }
  const auto n = static_cast<std::int64_t>(points_m.size());
  const torch::Tensor padded = torch::cat({channels, torch::zeros({1, channels.size(1)}, torch::kDouble)});
  const torch::Tensor gathered = padded.index_select(0, torch::tensor(places)).view({n, 8, channels.size(1)});
  return (gathered * torch::tensor(weights, torch::kDouble).view({n, 8, 1})).sum(1);
}

}  // namespace

Acquisition small_acquisition(double azimuth_rad) {
  Acquisition a;
  a.azimuth_rad = azimuth_rad;
  a.incidence_rad = 0.7;
  a.slant_range_m = 200.0;
  a.n_azimuth = 8;
  a.n_range = 16;
  a.azimuth_spacing_m = a.range_spacing_m = 0.5;
  return a;
}

std::vector<RowRequest> some_rows() {
  return {{small_acquisition(0.3), 3}, {small_acquisition(2.1), 5, 0.25, 0.75}};
}

RaySampling small_sampling() {
  RaySampling s;
  s.ray_spacing_m = 0.3;
  s.sub_rows = 2;
  s.longest_m = kVoxel_m;
  return s;
}

GridField small_grid(unsigned seed) {
  GridField field({glm::dvec3(0.1, 0.2, -0.1), kVoxel_m}, 2, 1.5);
  BrickTopology topology;
  std::vector<std::uint8_t> active;
  for (int x = -1; x <= 0; ++x)
    for (int y = -1; y <= 0; ++y)
      for (int z = -1; z <= 0; ++z) topology.insert({x, y, z});
  for (std::uint32_t b = 0; b < topology.n_bricks(); ++b) {
    for (int n = 0; n < kBrickVoxels; ++n) {
      const glm::ivec3 voxel = topology.coordinate(b) * kBrickSide + voxel_in_brick(n);
      active.push_back(glm::length(glm::dvec3(voxel)) * kVoxel_m < 1.5 ? 1 : 0);
    }
  }
  const auto n = static_cast<std::int64_t>(std::count(active.begin(), active.end(), std::uint8_t{1}));
  torch::manual_seed(seed);
  const torch::Tensor log_depth = torch::randn({n}) * 1.5f - 1.5f;
  torch::Tensor coefficients = torch::randn({n, 9}) * 0.05f;
  coefficients.select(1, 0) += 1.0f;
  field.set_voxels(std::move(topology), active, log_depth, coefficients);
  return field;
}

GridField with_all_voxels(const GridField& field, float log_depth) {
  GridField all(field.transform(), field.channels().harmonics_degree, field.source_scale());
  BrickTopology topology = field.topology();
  const auto n = static_cast<std::int64_t>(field.n_voxels());
  torch::Tensor depths = torch::full({n}, log_depth), coefficients = torch::zeros({n, 9});
  std::vector<std::int64_t> places(field.active_voxels().begin(), field.active_voxels().end());
  depths.index_copy_(0, torch::tensor(places), field.log_depth.detach());
  coefficients.index_copy_(0, torch::tensor(places), field.coefficients.detach());
  all.set_voxels(std::move(topology), std::vector<std::uint8_t>(field.n_voxels(), 1), depths, coefficients);
  return all;
}

torch::Tensor plain_rows(const GridField& field, std::span<const RowRequest> rows, const RaySampling& sampling) {
  const torch::Tensor kappa = field.log_depth.to(torch::kDouble).exp() / (2.0 * kVoxel_m);
  const torch::Tensor channels =
      torch::cat({kappa.unsqueeze(1), field.coefficients.to(torch::kDouble) * field.source_scale()}, 1);
  std::vector<torch::Tensor> images;
  for (const RowRequest& request : rows) {
    const Acquisition& a = request.acquisition;
    double step_rad = 0.0;
    torch::Tensor sum = torch::zeros({a.n_range}, torch::kDouble);
    for (const Ray& ray : rays_of_row(field, request, sampling, step_rad)) {
      const auto n = static_cast<std::int64_t>(ray.points_m.size());
      const torch::Tensor c = interpolate(field, channels, ray.points_m);
      std::vector<double> harmonics;
      const auto y = spherical_harmonics(glm::dvec3(ray.direction), 2);
      harmonics.assign(y.begin(), y.end());
      const torch::Tensor gamma = (c.narrow(1, 1, 9) * torch::tensor(harmonics, torch::kDouble)).sum(1).clamp_min(0.0);
      const torch::Tensor x = 2.0 * c.select(1, 0) * torch::tensor(ray.length_m, torch::kDouble);
      const torch::Tensor strict_triangle = torch::ones({n, n}, torch::kDouble).tril(-1);
      const torch::Tensor contribution = gamma * (-strict_triangle.matmul(x)).exp() * (1.0 - (-x).exp());
      torch::Tensor shares = torch::zeros({a.n_range, n}, torch::kDouble);
      for (std::int64_t s = 0; s < n; ++s) {
        const auto at = static_cast<std::size_t>(s);
        const double near = ray.near_bin[at];
        const double far = ray.near_bin[at] + ray.length_m[at] / a.range_spacing_m;
        for (int j = 0; j < a.n_range; ++j) {
          const double overlap = std::min(far, j + 1.0) - std::max(near, double(j));
          if (overlap > 0.0) shares[j][s] = overlap / (far - near);
        }
      }
      sum = sum + shares.matmul(contribution);
    }
    std::vector<double> scale;
    for (int j = 0; j < a.n_range; ++j)
      scale.push_back(a.range_m(j) * step_rad / (a.range_spacing_m * sampling.sub_rows));
    images.push_back(sum * torch::tensor(scale, torch::kDouble));
  }
  return torch::cat(images);
}

}  // namespace sarnerf
