// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/spherical_harmonics.h"

namespace sarnerf {

/// Channels of a grid that holds a scattering field, in this order: κ⁺ (1/m), κ⁻ (1/m) if the two differ,
/// and the harmonics' coefficients γ_lm of the brightness.
struct FieldChannels {
  bool two_extinctions = false;
  int harmonics_degree = 0;

  int first_harmonic() const { return two_extinctions ? 2 : 1; }
  int count() const { return first_harmonic() + n_harmonics(harmonics_degree); }
};

/// Which points lie on which ray; as in SampleBatch.
struct RayDirections {
  std::span<const std::uint32_t> ray_begin;  ///< [n_rays + 1]
  std::span<const glm::vec3>
      ray_direction;  ///< [n_rays] unit vectors, from the radar into the scene
};

/// What the integrators want to know at each point, or derivatives of a loss by it.
template <class T>
struct FieldPoints {
  std::span<T> extinction_per_m;       ///< κ⁺ [n_points]
  std::span<T> extinction_back_per_m;  ///< κ⁻ [n_points], empty unless the grid has it
  std::span<T> brightness;             ///< γ [n_points]
};

/// Samples a field along rays: first interpolates every channel, then combines,
///
///     γ(p, d) = max(0, Σ_lm γ_lm(p) Y_lm(d)),
///
/// clamped after the sum, so that what is between two voxels depends on both. The scattering P of printed
/// eq. 1 is (κ⁺ + κ⁻) γ, which the integrators' brightness form forms.
///
/// `points_m` [n_points] in the frame of the grid's transform. Throws UsageError where lengths or channels
/// do not fit. Cost: that of sample_trilinear().
void sample_field(const BrickView<const float>& grid, const FieldChannels& channels,
                  std::span<const glm::vec3> points_m, const RayDirections& rays,
                  const FieldPoints<float>& out);

/// Adjoint of sample_field(): adds to `grid_gradients`. `brightness` is what sample_field() gave: where it
/// was clamped to 0, its derivative is 0. Threads: as scatter_trilinear().
void sample_field_adjoint(const BrickView<float>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::vec3> points_m, const RayDirections& rays,
                          std::span<const float> brightness,
                          const FieldPoints<const float>& point_gradients);

}  // namespace sarnerf
