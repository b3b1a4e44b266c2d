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

// The one sampling core of simulation and learning. An azimuth row goes
//
//     ray grid ─► rays ─► segments ─► field ─► contributions ─► range bins
//             even or    marched      κ, P    emission and     in the bin or
//             jittered   and cut              absorption       over the footprint
//
// and derivatives by the bins come back to the field's values at the segments. The voxel engine, both learned fields and the
// plain learner of sar_nerf_bench take this way; the surface engine shares places of slices, bins, deposit and scale.

namespace sarnerf {

/// How densely a row is sampled by rays.
struct RowSampling {
  double ray_spacing_m = 0.15;  ///< between neighbouring rays of a jittered fan, across them at the aim point
  int sub_rows = 1;             ///< slices: rays that share a place in the fan, spread over the row's width
  double longest_m = 0.15;      ///< of a segment
  double end_depth = kEndOfRayDepth;  ///< two-way optical depth at which a ray ends
};

/// One azimuth row of one view. `jitter` in [0, 1)² shifts its rays within their spacing, along track and in
/// the fan: 0.5 is the centred place. Rays have angles δ within the limits. With a fan given, rays are its own, evenly spread
/// over the slices, and neither jittered nor limited.
struct RowRequest {
  Acquisition acquisition;  ///< its aim point is the origin of the field's frame
  int row = 0;
  double along_track_jitter = 0.5;
  double fan_jitter = 0.5;
  double least_angle_rad = -std::numeric_limits<double>::infinity();
  double most_angle_rad = std::numeric_limits<double>::infinity();
  std::optional<Fan> even{};
};

/// Pixels of rows one behind the other.
std::size_t n_pixels(std::span<const RowRequest> rows);

/// Along-track coordinate (m) of the centre of one of a row's slices of equal width.
double slice_along_m(const Acquisition& acquisition, int row, int slice, int n_slices);

/// β⁰ of bin j over the sum of contributions that it got from n_slices slices: r_j Δθ / (Δr n_slices).
double beta0_per_contribution(const Acquisition& acquisition, double step_rad, int n_slices, int j);

/// The rays of a row that meet a box, each with the part of it inside.
struct RowRays {
  RayGrid grid;
  std::vector<MarchRay> rays;
};

/// All rays of a fan in each of the row's slices. `box_m` is relative to the aim point.
RowRays even_rays(const Acquisition& acquisition, int row, const Fan& fan, int n_slices, const Box& box_m);

/// Rays of a comb that begins at the aim point and is shifted by the request's jitter, so that the box decides
/// which rays there are and not where; along track they are shifted against each other by the golden ratio, so that few rays
/// cover both directions evenly.
RowRays jittered_rays(const RowRequest& request, const Box& box_m, const RowSampling& sampling);

/// The one or the other, as the request says.
RowRays rays_of_row(const RowRequest& request, const Box& box_m, const RowSampling& sampling);

/// The rays of some azimuth rows as one thread takes them from their grids to their range bins, and derivatives back. Its
/// memory, about 60 bytes a segment, is used again after clear().
class AzimuthRows {
 public:
  struct Row {
    Acquisition acquisition;
    int row;
    Fan fan;
    int n_slices;
    std::size_t first_ray, end_ray;  ///< in the batch
  };

  /// Forgets rows, rays and segments.
  void clear();

  /// Rays that are added from now on belong to this row.
  void begin_row(const RayGrid& grid, int row, int n_slices);

  /// Adds rays, marched and sampled where the marcher's volume is occupied. `depth` as in VolumeMarcher::march.
  void march(VolumeMarcher& marcher, const RayGrid& grid, std::span<const MarchRay> rays, std::span<double> depth = {});

  /// Adds rays for a field that is no grid: stretches in which the marcher's volume is occupied, cut at the borders of bins
  /// and then evenly, so that no segment is longer than `longest_m`. Rays end where the marcher's do; those that meet nothing
  /// are left out.
  void cut(VolumeMarcher& marcher, const RayGrid& grid, std::span<const MarchRay> rays, double longest_m);
  /// The same, dense: wherever the rays are inside.
  void cut(const RayGrid& grid, std::span<const MarchRay> rays, double longest_m);

  const std::vector<Row>& rows() const { return rows_; }
  const SampleBatch& batch() const { return batch_; }
  const BatchField& field() const { return field_; }
  std::size_t n_segments() const { return batch_.n_segments(); }
  std::size_t n_pixels() const;  ///< of the rows, one behind the other
  std::uint32_t first_segment(const Row& row) const { return batch_.ray_begin[row.first_ray]; }
  std::uint32_t end_segment(const Row& row) const { return batch_.ray_begin[row.end_ray]; }

  /// Values at the segments of a field that is no grid, [n_segments] each; κ⁻ = κ⁺ where `extinction_back_per_m` is empty.
  void set_field(std::span<const float> extinction_per_m, std::span<const float> source,
                 std::span<const float> extinction_back_per_m = {});

  /// Adds Σ c_s of a row's rays to its bins [n_range], from the field at the segments (printed eqs. 6, 24).
  void integrate(const Row& row, SourceBasis basis, Integrator integrator, Deposit deposit, std::span<double> bins);

  /// Its adjoint: from ∂L/∂bin [n_range] writes ∂L/∂κ⁺, ∂L/∂κ⁻ and ∂L/∂source of the row's segments; the arrays are those of
  /// all segments. Exact in the bin. Over the footprint, trapezoids are held where the field puts them: their own motion with
  /// the field, half a step between rays at most, is left out.
  void integrate_adjoint(const Row& row, SourceBasis basis, Integrator integrator, Deposit deposit,
                         std::span<const double> bin_gradients, const FieldGradients<float>& gradients);

  // Over the footprint, piece by piece: for rows whose segments would not fit into memory, and for layers, which want to
  // know what each segment adds.

  /// Opens a lattice of slices and places (FootprintDeposit), which clear() leaves alone; rays that are added from now on lie
  /// at their MarchRay's slice and place, until the next integrate().
  void begin_lattice(std::size_t n_slices, const std::vector<bool>& consecutive);
  /// Finds the emission of the rays at places [first, end) of all slices, all of which the batch holds.
  void emit(SourceBasis basis, Integrator integrator, std::size_t first, std::size_t end);
  /// Adds a slice's rays at places [first, end) to the bins. Emissions of the neighbours must be known.
  void deposit(std::size_t slice, std::size_t first, std::size_t end, std::span<double> bins) const;
  const FootprintDeposit& lattice() const { return lattice_; }

 private:
  SegmentSpans<float> segments(const Row& row) const;
  void set_places(std::span<const MarchRay> rays, std::size_t first_ray);
  void make_lattice(const Row& row, SourceBasis basis, Integrator integrator);
  template <class Visit>
  void for_each_trapezoid(Visit&& visit) const;

  std::vector<Row> rows_;
  SampleBatch batch_;
  BatchField field_;
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
