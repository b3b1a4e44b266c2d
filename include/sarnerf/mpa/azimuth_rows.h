// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/deposit.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/mpa/volume_march.h"

// Sampling and integration of azimuth rows, shared by simulation and learning:
//
//     ray grid ─► rays ─► segments ─► field ─► contributions ─► range bins
//             even or    marched      κ, P    emission and     in the bin or
//             jittered   and cut              absorption       over the footprint
//
// The adjoint takes derivatives by the bins back to the field's values at the segments. The voxel engine, both learned fields
// and the plain learner of sar_nerf_bench use it. The surface engine uses the same slice positions, bins, deposit and scale.

namespace sarnerf {

/// Sampling density of a row.
struct RowSampling {
  double ray_spacing_m = 0.15;  ///< between neighbouring rays of a jittered fan, perpendicular to them, at the aim point
  int sub_rows = 1;             ///< slices across the row's width; the rays of the fan are cast once in each slice
  double longest_m = 0.15;      ///< longest segment
  double end_depth = kEndOfRayDepth;  ///< two-way optical depth at which a ray ends
};

/// One azimuth row of one view. The jitters, in [0, 1), shift its rays within their spacing, along track and in
/// the fan: 0.5 is centred. Ray angles δ lie within the limits. If `even` is set, its rays are used instead, at the centre of
/// each slice, and neither jittered nor limited.
struct RowRequest {
  Acquisition acquisition;  ///< its aim point is the origin of the field's frame
  int row = 0;
  double along_track_jitter = 0.5;
  double fan_jitter = 0.5;
  double least_angle_rad = -std::numeric_limits<double>::infinity();
  double most_angle_rad = std::numeric_limits<double>::infinity();
  std::optional<Fan> even{};
};

/// Total number of pixels of the rows.
std::size_t n_pixels(std::span<const RowRequest> rows);

/// Along-track coordinate (m) of the centre of a slice of a row that is divided into n_slices of equal width.
double slice_along_m(const Acquisition& acquisition, int row, int slice, int n_slices);

/// Ratio of β⁰ of bin j to the sum of its contributions from n_slices slices: r_j Δθ / (Δr n_slices), Δθ = `step_rad`.
double beta0_per_contribution(const Acquisition& acquisition, double step_rad, int n_slices, int j);

/// The rays of a row that meet a box, each with the part of it inside.
struct RowRays {
  RayGrid grid;
  std::vector<MarchRay> rays;
};

/// All rays of a fan in each of the row's slices. `box_m` is relative to the aim point.
RowRays even_rays(const Acquisition& acquisition, int row, const Fan& fan, int n_slices, const Box& box_m);

/// Rays at evenly spaced angles that are counted from the aim point and shifted by the request's jitter: the box selects rays,
/// but does not move them. Along track, successive rays are shifted by the golden ratio, so that few rays cover both
/// directions evenly.
RowRays jittered_rays(const RowRequest& request, const Box& box_m, const RowSampling& sampling);

/// even_rays() if the request has a fan, else jittered_rays().
RowRays rays_of_row(const RowRequest& request, const Box& box_m, const RowSampling& sampling);

/// Way of a pulse to a point and back.
enum class Path {
  direct,
  /// Once by a level, specular ground, in either order: radar, ground, point, radar. Point and mirror image average to the
  /// point's foot on the ground, whose range it has, in the same row.
  by_ground,
};

/// The rays of some azimuth rows: samples them, integrates them into range bins, and takes derivatives back. One per thread.
/// Its memory, about 60 bytes a segment, is reused after clear().
class AzimuthRows {
 public:
  struct Row {
    Acquisition acquisition;
    int row;
    Fan fan;
    int n_slices;
    std::size_t first_ray, end_ray;  ///< in the batch
  };

  /// Removes rows, rays and segments.
  void clear();

  /// Rays that are added from now on belong to this row.
  void begin_row(const RayGrid& grid, int row, int n_slices);

  /// Adds rays, marched and sampled where the marcher's volume is occupied. `depth` as in VolumeMarcher::march.
  void march(VolumeMarcher& marcher, const RayGrid& grid, std::span<const MarchRay> rays, std::span<double> depth = {});

  /// Adds rays for a field that is not a grid. Intervals in which the marcher's volume is occupied are cut at the borders of
  /// bins and then evenly, so that no segment is longer than `longest_m`. Rays end where the marcher's do; rays that meet no
  /// occupied voxels are left out.
  void cut(VolumeMarcher& marcher, const RayGrid& grid, std::span<const MarchRay> rays, double longest_m);
  /// The same without a marcher: all of each ray's `inside` up to the last bin. No ray is left out.
  void cut(const RayGrid& grid, std::span<const MarchRay> rays, double longest_m);

  const std::vector<Row>& rows() const { return rows_; }
  const SampleBatch& batch() const { return batch_; }
  const BatchField& field() const { return field_; }
  std::size_t n_segments() const { return batch_.n_segments(); }
  std::size_t n_pixels() const;  ///< total number of the rows' pixels
  std::uint32_t first_segment(const Row& row) const { return batch_.ray_begin[row.first_ray]; }
  std::uint32_t end_segment(const Row& row) const { return batch_.ray_begin[row.end_ray]; }

  /// Sets the values of a field that is not a grid, [n_segments] each; κ⁻ = κ⁺ where `extinction_back_per_m` is empty.
  void set_field(std::span<const float> extinction_per_m, std::span<const float> source,
                 std::span<const float> extinction_back_per_m = {});
  /// Sets the source of Path::by_ground, [n_segments], and the ground's height above the aim point. `clear()` removes it.
  void set_bounce(std::span<const float> source, double ground_height_m);
  bool has_bounce() const { return !bounce_.empty(); }

  /// Adds Σ c_s of a row's rays to its bins [n_range], from the field at the segments (printed eqs. 6, 24).
  void integrate(const Row& row, SourceBasis basis, Integrator integrator, Deposit deposit, std::span<double> bins,
                 Path path = Path::direct);

  /// Adjoint of integrate(): from ∂L/∂bin [n_range] writes ∂L/∂κ⁺, ∂L/∂κ⁻ and ∂L/∂source of the row's
  /// segments; the arrays are those of all segments. Exact for Deposit::in_bin. Over the footprint, the trapezoids are held
  /// fixed: the derivative of their position by the field is left out (they move by half a step between rays at most).
  void integrate_adjoint(const Row& row, SourceBasis basis, Integrator integrator, Deposit deposit,
                         std::span<const double> bin_gradients, const FieldGradients<float>& gradients, Path path = Path::direct);

  // The deposit over the footprint in pieces: for rows whose segments would not fit into memory, and for layers, which need
  // the contribution of each segment.

  /// Begins a lattice of slices and places (FootprintDeposit), which clear() keeps. Rays that are added from now on get their
  /// MarchRay's slice and place, until the next integrate() or integrate_adjoint() over the footprint.
  void begin_lattice(std::size_t n_slices, const std::vector<bool>& consecutive);
  /// Computes the emission of the rays at places [first, end) of all slices; the batch must hold all of these rays.
  void emit(SourceBasis basis, Integrator integrator, std::size_t first, std::size_t end);
  /// Adds a slice's rays at places [first, end) to the bins. The emissions of their neighbours must have been computed.
  void deposit(std::size_t slice, std::size_t first, std::size_t end, std::span<double> bins) const;
  const FootprintDeposit& lattice() const { return lattice_; }

 private:
  SegmentSpans<float> segments(const Row& row, Path path) const;
  FieldSamples<float> samples_of(SourceBasis basis, Path path) const;
  const std::vector<double>& near_bins(Path path) const { return path == Path::direct ? field_.near_bin : foot_near_bin_; }
  void set_places(std::span<const MarchRay> rays, std::size_t first_ray);
  void make_lattice(const Row& row, SourceBasis basis, Integrator integrator, Path path);
  template <class Visit>
  void for_each_trapezoid(Visit&& visit) const;

  std::vector<Row> rows_;
  SampleBatch batch_;
  BatchField field_;
  std::vector<float> bounce_;           ///< source of Path::by_ground
  std::vector<double> foot_near_bin_;   ///< near_bin of Path::by_ground
  std::vector<std::uint32_t> foot_bin_;
  std::vector<std::uint32_t> ray_slice_;  ///< of all rays
  FootprintDeposit lattice_;
  bool on_lattice_ = false;  ///< whether rays that are added belong to the lattice
  SampleBatch coarse_;  ///< of cut()
  BatchField coarse_field_;
  std::vector<std::uint32_t> row_ray_begin_;  ///< of the lattice's row, counted from its first segment
  std::vector<double> segment_gradients_;
  std::vector<std::uint32_t> own_bin_;
};

}  // namespace sarnerf
