// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// Degrees 0, 1 and 2 are supported: 1, 4 and 9 harmonics.
inline constexpr int kMaxHarmonicsDegree = 2;
inline constexpr int kMaxHarmonics = 9;
constexpr int n_harmonics(int degree) { return (degree + 1) * (degree + 1); }

/// Real orthonormal spherical harmonics Y_lm of a unit vector in world axes, in the order (0,0), (1,−1),
/// (1,0), (1,1), (2,−2) … (2,2); no Condon–Shortley sign. Those beyond `degree` are left 0.
template <class T>
std::array<T, kMaxHarmonics> spherical_harmonics(const glm::vec<3, T>& d, int degree) {
  constexpr T kSqrt5 = T(2.23606797749978969640917366873127624L);
  constexpr T kZero = std::numbers::inv_sqrtpi_v<T> / 2;  // √(1/4π)
  constexpr T kOne = std::numbers::sqrt3_v<T> * kZero;    // √(3/4π)
  constexpr T kTwo = kSqrt5 * kOne;                       // √(15/4π)
  constexpr T kTwoAxial = kSqrt5 * kZero / 2;             // √(5/16π)

  std::array<T, kMaxHarmonics> y{};
  y[0] = kZero;
  if (degree >= 1) {
    y[1] = kOne * d.y;
    y[2] = kOne * d.z;
    y[3] = kOne * d.x;
  }
  if (degree >= 2) {
    y[4] = kTwo * d.x * d.y;
    y[5] = kTwo * d.y * d.z;
    y[6] = kTwoAxial * (3 * d.z * d.z - 1);
    y[7] = kTwo * d.x * d.z;
    y[8] = kTwo / 2 * (d.x * d.x - d.y * d.y);
  }
  return y;
}

/// Trilinear interpolation of all channels at points, 0 where there is no brick.
///
/// `points_m` [n_points] in the frame of the grid's transform; `samples` [n_points × n_channels]. A
/// point that is not finite, or beyond the voxels that bricks can hold, gets 0. Indices are computed in
/// double, so that precision does not depend on the size of the scene; the rest is float32. Throws
/// UsageError where lengths do not fit. Cost: a brick look-up and eight voxels; 30 ns with one channel, 36
/// with five, on one thread of a shared, busy 2.5 GHz Xeon with the voxels in cache.
void sample_trilinear(const BrickView<const float>& grid, std::span<const glm::vec3> points_m,
                      std::span<float> samples);

/// sample_trilinear() for many small sets of points: keeps the last tile between calls. One per thread; the grid
/// must outlive it and not change meanwhile.
class TrilinearSampler {
 public:
  explicit TrilinearSampler(const BrickView<const float>& grid);
  void sample(std::span<const glm::vec3> points_m, std::span<float> samples);

 private:
  using Sample = void (*)(const BrickView<const float>&, BrickFinder&, std::span<const glm::vec3>,
                          const float* zeros, float* out);
  BrickView<const float> grid_;
  BrickFinder finder_;
  std::vector<float> zeros_;  ///< values of voxels in missing bricks
  Sample sample_;
};

/// Adjoint of sample_trilinear(): from ∂L/∂samples [n_points × n_channels] adds ∂L/∂voxels to `grid_gradients`.
/// Derivatives by voxels outside of the bricks are dropped. Several threads need arrays of their own, or bricks
/// that no two of them write.
void scatter_trilinear(const BrickView<float>& grid_gradients, std::span<const glm::vec3> points_m,
                       std::span<const float> sample_gradients);

/// Gradients (1/m) of the interpolation of a grid of one channel, at points: of the trilinear function in each cell, so they jump
/// from cell to cell. 0 where there is no brick. Throws UsageError for more channels and where lengths do not fit.
void sample_gradients(const BrickView<const float>& grid, std::span<const glm::vec3> points_m, std::span<glm::vec3> gradients);

/// Adjoint of sample_gradients(): from ∂L/∂gradients adds ∂L/∂voxels to `grid_gradients`. Threads: as scatter_trilinear().
void scatter_gradients(const BrickView<float>& grid_gradients, std::span<const glm::vec3> points_m,
                       std::span<const glm::vec3> by_gradients);

/// Meaning of the channels after the extinctions, which give the source term.
enum class SourceBasis {
  scattering,  ///< P (1/m), one channel
  harmonics,   ///< coefficients γ_lm of the brightness; degree 0 is isotropic
  cosine,      ///< γ₀, a normal (x, y, z) and an exponent p: γ₀ |n·d|^p, as in materials
};

/// Channels of a grid that holds a scattering field, in this order: κ⁺ (1/m), κ⁻ (1/m) if the two differ,
/// and those of the source basis.
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

/// Assigns points to rays, as in SampleBatch.
struct RayDirections {
  std::span<const std::uint32_t> ray_begin;  ///< [n_rays + 1]
  std::span<const glm::vec3>
      ray_direction;  ///< [n_rays] unit vectors, from the radar into the scene
};

/// Input of the integrators at each point, or the derivatives of a loss by it.
template <class T>
struct FieldPoints {
  std::span<T> extinction_per_m;       ///< κ⁺ [n_points]
  std::span<T> extinction_back_per_m;  ///< κ⁻ [n_points], empty unless the grid has it
  std::span<T> source;                 ///< P for SourceBasis::scattering, else γ [n_points]
};

/// Samples a field along rays: first interpolates every channel, then computes the source from them. With c the
/// interpolated channels at p and n̂ the interpolated normal, scaled to length 1, the source is
///
///     scattering  P = max(0, c)
///     harmonics   γ(p, d) = max(0, Σ_lm c_lm Y_lm(d)), clamped after the sum, so that values between two
///                 voxels depend on both
///     cosine      γ(p, d) = max(0, c_γ) |n̂·d|^max(0, c_p); 0^0 = 1. The sign of the normal does not matter: the
///                 far side of a solid is hidden, and a thin shell has no far side.
///
/// The scattering P of printed eq. 1 is (κ⁺ + κ⁻) γ, as in the integrators' brightness form.
///
/// `points_m` [n_points] in the frame of the grid's transform. Throws UsageError where lengths or channels
/// do not fit. Cost: that of sample_trilinear().
void sample_field(const BrickView<const float>& grid, const FieldChannels& channels,
                  std::span<const glm::vec3> points_m, const RayDirections& rays,
                  const FieldPoints<float>& out);

/// A ray's direction and the number of its points to sample.
struct PointsOfRay {
  glm::vec3 direction;
  std::size_t n_points;
};

/// sample_field() for a few points of some rays at a time: keeps the last tile and its memory between calls. One per
/// thread; the grid must outlive it and not change meanwhile.
class FieldSampler {
 public:
  FieldSampler(const BrickView<const float>& grid, const FieldChannels& channels);

  /// `points_m`: the points of the first ray, then those of the next, and so on. The arrays of `out` must be as long; this
  /// is not checked.
  void sample(std::span<const PointsOfRay> rays, std::span<const glm::vec3> points_m, const FieldPoints<float>& out);

 private:
  void combine(const glm::vec3& direction, std::size_t first, std::size_t n_points,
               const FieldPoints<float>& out) const;

  TrilinearSampler trilinear_;
  FieldChannels channels_;
  std::vector<float> samples_;  ///< interpolated channels of the present block of points
};

/// Adjoint of sample_field() for harmonics; throws UsageError for the other bases, which are not learned. Adds to
/// `grid_gradients`. `brightness` is the source from sample_field(): where it was clamped to 0, its derivative is
/// 0. Threads: as scatter_trilinear().
void sample_field_adjoint(const BrickView<float>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::vec3> points_m, const RayDirections& rays,
                          std::span<const float> brightness,
                          const FieldPoints<const float>& point_gradients);

}  // namespace sarnerf

/// Scalar double-precision reference for the functions above: one voxel at a time, written to be read and
/// checked, not to be fast. Tests compare the float32 versions with it.
namespace sarnerf::oracle {

void sample_trilinear(const BrickView<const double>& grid, std::span<const glm::dvec3> points_m,
                      std::span<double> samples);

void scatter_trilinear(const BrickView<double>& grid_gradients,
                       std::span<const glm::dvec3> points_m,
                       std::span<const double> sample_gradients);

void sample_field(const BrickView<const double>& grid, const FieldChannels& channels,
                  std::span<const glm::dvec3> points_m, const RayDirections& rays,
                  const FieldPoints<double>& out);

void sample_field_adjoint(const BrickView<double>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::dvec3> points_m, const RayDirections& rays,
                          std::span<const double> brightness,
                          const FieldPoints<const double>& point_gradients);

}  // namespace sarnerf::oracle
