// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/spherical_harmonics.h"
#include "sarnerf/field/trilinear.h"

namespace sarnerf {

/// What the channels behind the extinctions say about the source term.
enum class SourceBasis {
  scattering,  ///< P (1/m), one channel
  harmonics,   ///< coefficients γ_lm of the brightness; degree 0 is an isotropic one
  cosine,      ///< γ₀, a normal (x, y, z) and an exponent p: γ₀ |n·d|^p, as of materials
};

/// Channels of a grid that holds a scattering field, in this order: κ⁺ (1/m), κ⁻ (1/m) if the two differ,
/// and those of the source's basis.
struct FieldChannels {
  bool two_extinctions = false;
  int harmonics_degree = 0;
  SourceBasis basis = SourceBasis::harmonics;

  int first_source() const { return two_extinctions ? 2 : 1; }
  int n_source() const {
    if (basis == SourceBasis::scattering) return 1;
    return basis == SourceBasis::cosine ? 5 : n_harmonics(harmonics_degree);
  }
  int count() const { return first_source() + n_source(); }
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
  std::span<T> source;                 ///< P for SourceBasis::scattering, else γ [n_points]
};

/// Samples a field along rays: first interpolates every channel, then combines. With c the interpolated
/// channels at p and n̂ the interpolated normal brought back to length 1, the source is
///
///     scattering  P = max(0, c)
///     harmonics   γ(p, d) = max(0, Σ_lm c_lm Y_lm(d)), clamped after the sum, so that what is between two
///                 voxels depends on both
///     cosine      γ(p, d) = max(0, c_γ) |n̂·d|^max(0, c_p); 0^0 = 1. Both signs of the normal count: a solid
///                 hides its far side, and a thin shell has none.
///
/// The scattering P of printed eq. 1 is (κ⁺ + κ⁻) γ, which the integrators' brightness form forms.
///
/// `points_m` [n_points] in the frame of the grid's transform. Throws UsageError where lengths or channels
/// do not fit. Cost: that of sample_trilinear().
void sample_field(const BrickView<const float>& grid, const FieldChannels& channels,
                  std::span<const glm::vec3> points_m, const RayDirections& rays,
                  const FieldPoints<float>& out);

/// A ray's direction and how many points on it are asked for.
struct PointsOfRay {
  glm::vec3 direction;
  std::size_t n_points;
};

/// The same for a few points of some rays at a time: remembers where it was and keeps its memory. One per thread; the
/// grid must outlive it and not change meanwhile.
class FieldSampler {
 public:
  FieldSampler(const BrickView<const float>& grid, const FieldChannels& channels);

  /// Points of the rays one behind the other. Arrays of `out` as long as the points; not checked.
  void sample(std::span<const PointsOfRay> rays, std::span<const glm::vec3> points_m, const FieldPoints<float>& out);

 private:
  void combine(const glm::vec3& direction, std::size_t first, std::size_t n_points,
               const FieldPoints<float>& out) const;

  TrilinearSampler trilinear_;
  FieldChannels channels_;
  std::vector<float> samples_;  ///< interpolated channels of the points under way
};

/// Adjoint of sample_field() for harmonics; UsageError for the other bases, which nobody learns. Adds to
/// `grid_gradients`. `brightness` is what sample_field() gave: where it was clamped to 0, its derivative is
/// 0. Threads: as scatter_trilinear().
void sample_field_adjoint(const BrickView<float>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::vec3> points_m, const RayDirections& rays,
                          std::span<const float> brightness,
                          const FieldPoints<const float>& point_gradients);

}  // namespace sarnerf
