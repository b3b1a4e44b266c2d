// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/render/layers.h"

namespace sarnerf {

/// Geometry of one view for layers: positions of pixels in space, and of the reference plane among the pixels.
/// Ray coordinates k are real numbers here; ray k lies at the integer k.
class LayerView {
 public:
  LayerView(const Acquisition& acquisition, const Fan& fan, double reference_height_m);

  int n_range() const { return acquisition_.n_range; }
  double range_spacing_m() const { return acquisition_.range_spacing_m; }

  /// Height above the reference plane (m) of the point on ray coordinate k at bin coordinate x.
  double height_m(double k, double x) const;

  /// Angle between ray k and the vertical (rad).
  double incidence_rad(double k) const { return acquisition_.incidence_rad + fan_.ray_angle_rad(k); }

  /// Bin coordinate at which ray k meets the reference plane; infinite if it does not.
  double plane_bin(double k) const;

  /// Ray coordinate of the reference plane's point at the centre of bin j, ascending with j; −infinity for
  /// bins nearer than the plane.
  double plane_ray(int j) const { return plane_ray_[static_cast<std::size_t>(j)]; }

  /// Bins [first, second) whose reference-plane points lie between two ray coordinates.
  std::pair<int, int> plane_bins(double first_ray, double last_ray) const;

 private:
  Acquisition acquisition_;
  Fan fan_;
  double above_plane_m_;           ///< height of the aim point above the reference plane
  std::vector<double> plane_ray_;  ///< [n_range]
};

/// Part of a slice between two ray coordinates, over which range changes linearly: a piece of a
/// face, or a segment of one ray through a volume.
struct LayerRun {
  Component component = Component::other;
  double mass = 0.0;  ///< γ times ray steps, as deposited in the image
  double first_ray = 0.0, last_ray = 0.0;  ///< ascending
  double first_bin = 0.0, last_bin = 0.0;  ///< bin coordinates there
  double smear = 0.0;                      ///< range change (bins) over the slice's width
  double incidence_rad = kNoIncidence;     ///< between ray and normal
  bool counts = true;                      ///< whether it counts as a scatterer

  static constexpr double kNoIncidence = std::numeric_limits<double>::quiet_NaN();
};

/// Accumulates the layers of one azimuth row, slice by slice, for either engine. Scratch of one worker.
///
/// Scatterers of a bin are the maximal groups of neighbouring rays that contribute to it from one
/// component. For the mask, visible ground is one of them: the reference plane, whether or not it scatters, or
/// instead a mesh of component ground. Plane and mesh are not counted twice, so that a ground mesh slightly off
/// the plane is no layover.
/// Cost: some ten nanoseconds a bin that a run touches, and one or two nanoseconds a bin of each slice.
class LayerRow {
 public:
  LayerRow(const LayerView& view, const LayerSet& layers);

  const LayerView& view() const { return view_; }

  void begin_row();
  void begin_slice();

  /// Adds a run of anything but the infinite ground. Runs of one component must come in ascending order of rays.
  void add(const LayerRun& run);

  /// Adds a run of the infinite ground.
  void add_ground(const LayerRun& run);

  /// Adds the infinite ground's power in each bin of the slice, in the units of LayerRun::mass.
  void add_ground(std::span<const double> mass);

  /// Marks the reference plane as hidden where it lies behind a surface between these rays at these bins.
  void hide(Component by, double first_ray, double last_ray, double first_bin, double last_bin);

  /// The same for an object somewhere on ray k.
  void hide_behind(int k);

  void end_slice();

  /// Writes row i. `beta0_per_mass`: the image's factors [n_range] for the mass of one slice.
  void end_row(int i, std::span<const double> beta0_per_mass, Layers& layers) const;

 private:
  static constexpr double kNoRay = -std::numeric_limits<double>::infinity();

  struct Sums {
    std::array<double, kNumberOfComponents> mass{};  ///< by Component − 1
    double height = 0.0;                             ///< Σ mass × height
    double incidence = 0.0, with_incidence = 0.0;    ///< Σ mass × angle, and Σ mass of runs with an angle
  };
  struct OfSlice {
    std::array<double, kNumberOfComponents> last_ray;  ///< last ray of each component's current group
    int n_groups = 0;                 ///< groups of anything but ground
    int n_ground_groups = 0;          ///< groups of meshes of component ground
    bool hidden = false;              ///< the reference plane is hidden by anything
    bool hidden_by_object = false;    ///< it is hidden by something other than ground
    bool ground = false;              ///< the infinite ground contributes
  };

  void sum(std::size_t j, Component component, double mass, double ray, double bin, double incidence_rad);
  void group(std::size_t j, const LayerRun& run);

  const LayerView& view_;
  LayerSet layers_;
  bool groups_;  ///< whether mask or scatterers are asked for
  double coplanar_bins_;
  int n_slices_ = 0;
  std::vector<Sums> sums_;
  std::vector<OfSlice> of_slice_;
  std::vector<std::array<std::uint32_t, 4>> votes_;  ///< number of slices for each MaskValue
  std::vector<std::uint32_t> n_scatterers_;          ///< sum over all slices
};

}  // namespace sarnerf
