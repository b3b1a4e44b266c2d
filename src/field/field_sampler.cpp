// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/field_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "check_field.h"

namespace sarnerf {
namespace {

/// Points of a block: its interpolated channels stay in the first level cache between the two steps.
constexpr std::size_t kBlockPoints = 256;

/// Calls visit(direction of the ray, first, end) for the parts of [first, end) that lie on one ray.
/// `ray` is updated to the ray of the last part, from which the next block continues.
template <class Visit>
void for_each_ray(const RayDirections& rays, std::size_t first, std::size_t end, std::size_t& ray,
                  Visit&& visit) {
  while (first < end) {
    while (rays.ray_begin[ray + 1] <= first) ++ray;
    const std::size_t ray_end = std::min<std::size_t>(end, rays.ray_begin[ray + 1]);
    visit(rays.ray_direction[ray], first, ray_end);
    first = ray_end;
  }
}

/// γ₀ |n̂·d|^p of one point; `c` holds γ₀, the normal and p.
float cosine_brightness(const float* c, const glm::vec3& d) {
  const float gamma0 = std::max(0.0f, c[0]), exponent = std::max(0.0f, c[4]);
  const glm::vec3 normal(c[1], c[2], c[3]);
  const float length = glm::length(normal);
  const float cosine = length > 0.0f ? std::min(1.0f, std::abs(glm::dot(normal, d)) / length) : 0.0f;
  // Interpolation of equal exponents is exact up to rounding only.
  constexpr float kNear = 1e-5f;
  if (std::abs(exponent - 1.0f) < kNear) return gamma0 * cosine;
  if (std::abs(exponent - 2.0f) < kNear) return gamma0 * cosine * cosine;
  return exponent < kNear ? gamma0 : gamma0 * std::pow(cosine, exponent);
}

}  // namespace

FieldSampler::FieldSampler(const BrickView<const float>& grid, const FieldChannels& channels)
    : trilinear_(grid),
      channels_(channels),
      samples_(kBlockPoints * static_cast<std::size_t>(grid.n_channels)) {
  check_channels(grid.n_channels, channels);
}

void FieldSampler::sample(std::span<const PointsOfRay> rays, std::span<const glm::vec3> points_m,
                          const FieldPoints<float>& out) {
  const auto n_channels = static_cast<std::size_t>(channels_.count());
  std::size_t ray = 0, taken = 0;  // taken: points of this ray that are done
  for (std::size_t begin = 0; begin < points_m.size(); begin += kBlockPoints) {
    const std::size_t n = std::min(kBlockPoints, points_m.size() - begin);
    trilinear_.sample(points_m.subspan(begin, n), {samples_.data(), n * n_channels});
    const auto part = [&](std::span<float> all) { return all.empty() ? all : all.subspan(begin, n); };
    const FieldPoints<float> block{part(out.extinction_per_m), part(out.extinction_back_per_m), part(out.source)};
    for (std::size_t first = 0; first < n;) {
      const std::size_t some = std::min(n - first, rays[ray].n_points - taken);
      combine(rays[ray].direction, first, some, block);
      first += some;
      taken += some;
      if (taken == rays[ray].n_points) {
        ++ray;
        taken = 0;
      }
    }
  }
}

void FieldSampler::combine(const glm::vec3& d, std::size_t first, std::size_t n_points,
                           const FieldPoints<float>& out) const {
  const auto n_channels = static_cast<std::size_t>(channels_.count());
  const auto first_source = static_cast<std::size_t>(channels_.first_source());
  const auto each = [&](auto&& source_of) {
    for (std::size_t s = first; s < first + n_points; ++s) {
      const float* const sample = &samples_[s * n_channels];
      out.extinction_per_m[s] = sample[0];
      if (channels_.two_extinctions) out.extinction_back_per_m[s] = sample[1];
      out.source[s] = source_of(sample + first_source);
    }
  };
  switch (channels_.basis) {
    case SourceBasis::scattering:
      return each([](const float* c) { return std::max(0.0f, *c); });
    case SourceBasis::cosine:
      return each([&](const float* c) { return cosine_brightness(c, d); });
    case SourceBasis::harmonics:
      break;
  }
  const auto y = spherical_harmonics(d, channels_.harmonics_degree);
  const std::size_t n_coefficients = n_channels - first_source;
  each([&](const float* c) {
    float sum = 0.0f;
    for (std::size_t m = 0; m < n_coefficients; ++m) sum += c[m] * y[m];
    // Large coefficients may add up to more than float32 holds; a transmittance of 0 times infinity would be NaN.
    return std::min(std::max(0.0f, sum), std::numeric_limits<float>::max());
  });
}

void sample_field(const BrickView<const float>& grid, const FieldChannels& channels,
                  std::span<const glm::vec3> points_m, const RayDirections& rays,
                  const FieldPoints<float>& out) {
  check_field(grid.n_channels, channels, rays, points_m.size(), out);
  FieldSampler sampler(grid, channels);
  std::size_t ray = 0;
  for_each_ray(rays, 0, points_m.size(), ray,
               [&](const glm::vec3& d, std::size_t first, std::size_t end) {
                 const auto part = [&](std::span<float> all) {
                   return all.empty() ? all : all.subspan(first, end - first);
                 };
                 const PointsOfRay mine{d, end - first};
                 sampler.sample({&mine, 1}, points_m.subspan(first, end - first),
                                {part(out.extinction_per_m), part(out.extinction_back_per_m),
                                 part(out.source)});
               });
}

void sample_field_adjoint(const BrickView<float>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::vec3> points_m, const RayDirections& rays,
                          std::span<const float> brightness,
                          const FieldPoints<const float>& point_gradients) {
  expect_harmonics(channels);
  check_field(grid_gradients.n_channels, channels, rays, points_m.size(), point_gradients);
  expect_field_length(brightness.size(), points_m.size(), "brightness");
  const auto n_channels = static_cast<std::size_t>(grid_gradients.n_channels);
  const auto first_source = static_cast<std::size_t>(channels.first_source());
  const std::size_t n_coefficients = n_channels - first_source;
  std::vector<float> gradients(kBlockPoints * n_channels);
  std::size_t ray = 0;
  for (std::size_t begin = 0; begin < points_m.size(); begin += kBlockPoints) {
    const std::size_t n = std::min(kBlockPoints, points_m.size() - begin);
    const auto take_apart = [&](const glm::vec3& d, std::size_t first, std::size_t end) {
      const auto y = spherical_harmonics(d, channels.harmonics_degree);
      for (std::size_t s = first; s < end; ++s) {
        float* const gradient = &gradients[(s - begin) * n_channels];
        float* const by_coefficient = gradient + first_source;
        const float by_sum = brightness[s] > 0.0f ? point_gradients.source[s] : 0.0f;
        gradient[0] = point_gradients.extinction_per_m[s];
        if (channels.two_extinctions) gradient[1] = point_gradients.extinction_back_per_m[s];
        for (std::size_t m = 0; m < n_coefficients; ++m) by_coefficient[m] = by_sum * y[m];
      }
    };
    for_each_ray(rays, begin, begin + n, ray, take_apart);
    scatter_trilinear(grid_gradients, points_m.subspan(begin, n),
                      {gradients.data(), n * n_channels});
  }
}

}  // namespace sarnerf
