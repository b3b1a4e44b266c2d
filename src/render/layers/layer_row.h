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

/// Where the pixels of one view are in space, and where the reference plane is among them: what layers
/// need to know of a view. Rays have real-valued coordinates k here, the ray itself at whole ones.
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

  /// Ray coordinate of the reference plane's point in the middle of bin j, ascending with j; −infinity for
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

/// Part of a slice that lies between two ray coordinates and spans a range interval linearly: a piece of a
/// face, or what one ray sees of a volume.
struct LayerRun {
  Component component = Component::other;
  double mass = 0.0;  ///< γ times ray steps, as it goes to the image
  double first_ray = 0.0, last_ray = 0.0;  ///< ascending
  double first_bin = 0.0, last_bin = 0.0;  ///< bin coordinates there
  double smear = 0.0;                      ///< bins over the slice's width
  double incidence_rad = kNoIncidence;     ///< between ray and normal
  bool counts = true;                      ///< as a scatterer

  static constexpr double kNoIncidence = std::numeric_limits<double>::quiet_NaN();
};

/// Gathers the layers of one azimuth row, slice by slice, from either engine. Scratch of one worker.
///
/// Scatterers of a bin are the maximal groups of neighbouring rays that contribute to it from one
/// component. For the mask the ground is one of them wherever it is seen: the reference plane whether or not
/// it scatters, or a mesh of component ground in its place, which cannot lay over itself by a finger's height.
/// Cost: some ten nanoseconds a bin that a run touches, and a nanosecond or two a bin of each slice.
class LayerRow {
 public:
  LayerRow(const LayerView& view, const LayerSet& layers);

  const LayerView& view() const { return view_; }

  void begin_row();
  void begin_slice();

  /// A run of anything but the infinite ground. Those of one component must come with ascending rays.
  void add(const LayerRun& run);

  /// A run of the infinite ground.
  void add_ground(const LayerRun& run);

  /// What the infinite ground gives each bin of the slice, in the units of LayerRun::mass.
  void add_ground(std::span<const double> mass);

  /// Says that what lies between these rays at these bins hides the reference plane behind it.
  void hide(Component by, double first_ray, double last_ray, double first_bin, double last_bin);

  /// The same for an object somewhere on ray k.
  void hide_behind(int k);

  void end_slice();

  /// Writes row i. `beta0_per_mass(j)` as for the image, one slice's.
  void end_row(int i, std::span<const double> beta0_per_mass, Layers& layers) const;

 private:
  static constexpr double kNoRay = -std::numeric_limits<double>::infinity();

  struct Sums {
    std::array<double, kNumberOfComponents> mass{};  ///< by Component − 1
    double height = 0.0;                             ///< Σ mass × height
    double incidence = 0.0, with_incidence = 0.0;    ///< Σ mass × angle, and the mass of these
  };
  struct OfSlice {
    std::array<double, kNumberOfComponents> last_ray;  ///< of the group that each component is in
    int n_groups = 0;                 ///< of anything but ground
    int n_ground_groups = 0;          ///< of meshes that are ground
    bool hidden = false;              ///< the reference plane, by anything
    bool hidden_by_object = false;    ///< by something that is not ground itself
    bool ground = false;              ///< the infinite ground contributes
  };

  void sum(std::size_t j, Component component, double mass, double ray, double bin, double incidence_rad);
  void group(std::size_t j, const LayerRun& run);

  const LayerView& view_;
  LayerSet layers_;
  bool groups_;  ///< whether anybody asks for scatterers
  double coplanar_bins_;
  int n_slices_ = 0;
  std::vector<Sums> sums_;
  std::vector<OfSlice> of_slice_;
  std::vector<std::array<std::uint32_t, 4>> votes_;  ///< slices for each MaskValue
  std::vector<std::uint32_t> n_scatterers_;          ///< of all slices
};

}  // namespace sarnerf
