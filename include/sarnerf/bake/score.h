// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include <glm/glm.hpp>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// The true surface that an extracted one is compared with; world coordinates (m).
struct TruthSurface {
  SurfaceMesh solid;         ///< what volumes are taken from: closed pieces, which may overlap
  SurfaceMesh all;           ///< what distances are taken from
  std::size_t n_closed = 0;  ///< triangles of `all` that look outward; those behind them are seen from both sides
  /// `all`, with each open piece turned as a whole so that its outer side is outside: what winding numbers are taken of.
  /// Empty: `all` is so already.
  SurfaceMesh wound{};
};

/// The mesh of a scene as truth: closed pieces are the solid, and thin shells are surface alone. The ground plane is
/// no part of either. Which side of an open piece is outside, nobody says: it is turned so that together with fans from
/// its border to the border's centre it holds a positive volume. Cost: two copies of the mesh, three of an open one.
TruthSurface truth_of(const Scene& scene);

/// What the volume of the truth is.
enum class TruthVolume {
  closed_pieces,  ///< of TruthSurface::solid
  /// All that TruthSurface::all encloses: what air from above and from the sides, going through cells as wide as the
  /// columns' spacing, does not reach. For meshes of thin shells and with holes, as vehicles often are: holes wider
  /// than that spacing let air in, so it may have to be raised. The mesh stands on the ground: what is open below
  /// is filled.
  enclosed,
  /// What of the truth's box has a generalised winding number of TruthSurface::wound above 1/2 (Jacobson, Kavan &
  /// Sorkine-Hornung 2013): a hole is closed by about the flattest surface over it.
  winding_number,
  none,  ///< it has none: surfaces are compared, and volumes are not
};

/// "closed pieces", "enclosed", "winding number", "none".
std::string_view name(TruthVolume volume);

struct ScoreOptions {
  /// Between the vertical lines along which volumes are measured (m). 0: 1/512 of the longer horizontal side of the
  /// box around both surfaces.
  double column_spacing_m = 0.0;
  TruthVolume truth_volume = TruthVolume::closed_pieces;
  std::size_t n_samples = 100'000;  ///< points on each surface from which distances are taken
  Monitor monitor;
};

struct TruthVolumeChoice {
  TruthVolume volume = TruthVolume::closed_pieces;
  std::string reason;  ///< one line, for people; empty where all pieces are closed
};

/// Which volume a truth has. Closed pieces count by themselves. A truth with other triangles counts by what it encloses,
/// where that changes by no more than 5 % when the cells are doubled and is not less than half of what the winding number
/// finds; else by its winding number. It has no volume where more than 5 % of the samples in its box have a winding number
/// farther than 0.25 from a whole number, or none has one above 1/2. Cells are as wide as `column_spacing_m` of the options,
/// 0: 1/512 of the truth's longer horizontal side.
///
/// Throws as score(). Cost: that of `enclosed` and 1/8 of it, and of winding numbers at 64³ points: 3 s for a teapot.
TruthVolumeChoice truth_volume(const TruthSurface& truth, const ScoreOptions& options = {});

/// Not measured: there was nothing to measure from or to.
inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

/// Distances between two surfaces (m), each from points spread evenly over one surface to the nearest point of all
/// of the other. kNotMeasured where either surface is empty or has no such points.
struct SurfaceDistances {
  double completeness_m = kNotMeasured;  ///< mean from the truth to the extracted surface
  double accuracy_m = kNotMeasured;      ///< mean from the extracted surface to the truth
  /// Chamfer distance: ½ (completeness + accuracy), the mean of the two mean distances, not squared.
  double chamfer_m = kNotMeasured;
  double hausdorff_m = kNotMeasured;     ///< the larger of both directed maxima, over the points
  double percentile95_m = kNotMeasured;  ///< the larger of both directed 95th percentiles
};

/// How well an extracted surface agrees with the truth. Ratios have no unit.
struct SurfaceScore {
  /// Volume of the intersection over that of the union; 0 when either solid is empty. Like the next two and the true
  /// volume not measured for TruthVolume::none.
  double iou = 0.0;
  double precision = 0.0;  ///< part of the extracted volume that is true; 0 when either solid is empty
  double recall = 0.0;     ///< part of the true volume that was extracted; 0 when either solid is empty
  double volume_m3 = 0.0;  ///< of the extracted solid
  double truth_volume_m3 = 0.0;
  double volume_error = kNotMeasured;  ///< (extracted − true) / true volume; not measured without a true volume

  glm::dvec3 box_min_error_m{kNotMeasured};  ///< extracted minus true box, lower corner per axis, world axes
  glm::dvec3 box_max_error_m{kNotMeasured};  ///< the same of the upper corner
  /// Diagonal of the extracted box over that of the true one. Far from 1 when the two are in different units; 0 for
  /// an empty extracted surface, not measured for an empty truth.
  double size_ratio = kNotMeasured;

  SurfaceDistances whole;    ///< over all of both surfaces that is not buried
  SurfaceDistances visible;  ///< over what of it some view could see
  double visible_fraction = 0.0;            ///< by area, of the true surface that is not buried
  double extracted_visible_fraction = 0.0;  ///< the same of the extracted surface

  double column_spacing_m = 0.0;  ///< that was used; 0 when both surfaces are empty
  /// Of the vertical lines that meet the solid, the part along which it is not closed: above 0 the mesh has holes,
  /// and its volume means little.
  double open_fraction = 0.0;
  double truth_open_fraction = 0.0;  ///< the same of the truth; 0 unless its closed pieces were taken
};

/// Compares an extracted surface with the truth.
///
/// Volumes: of what lies inside (winding number above zero) along a lattice of vertical lines; pieces that overlap
/// count once, a mesh that looks inward holds nothing. The truth's volume is that of `solid`, of a scene's closed
/// pieces; where a scene is made of thin shells too that is little, and truth_volume() says what to take.
///
/// Distances: from `n_samples` points a surface, at equal steps of area, always the same ones; less those that are
/// buried in the surface's own solid, as where pieces overlap. A point is visible when in some view it faces the
/// radar (|n·d| > 1e-4; thin shells on either side), lies within the view's rows and bins, and the straight line to
/// the radar, in the row's plane, meets nothing of the same surface. The truth's points are tested against the
/// truth, the extracted surface's against itself. Points are lifted off their surface by 1e-5 of half its box's
/// diagonal.
///
/// World coordinates in metres, of any offset and scale. Results do not depend on the number of threads. Without
/// views nothing is visible.
///
/// Throws InputError for a mesh that uses vertices which do not exist or are not finite, and for a truth with
/// fewer triangles than closed ones; GeometryError for an impossible view; UsageError for impossible options;
/// Interrupted on request.
///
/// Cost: dominated by some microseconds a point for distances, and for each point that no view sees by up to a
/// ray, about 1 µs, a view that it faces; on all threads. `enclosed` takes a byte a cell, 134 MB for 512³;
/// `winding_number` takes 2 s for columns of a
/// bunny with 400 border edges on two busy threads.
SurfaceScore score(const SurfaceMesh& extracted, const TruthSurface& truth, std::span<const Acquisition> views,
                   const ScoreOptions& options = {});

}  // namespace sarnerf
