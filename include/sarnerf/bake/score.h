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
  SurfaceMesh solid;         ///< for volumes: closed pieces, which may overlap
  SurfaceMesh all;           ///< for distances: all pieces, closed ones first
  std::size_t n_closed = 0;  ///< first triangles of `all`, which face outward; the others are seen from both sides
  /// For winding numbers: `all`, with open pieces flipped as a whole where they face inward. Empty: as `all`.
  SurfaceMesh wound{};
};

/// The mesh of a scene as truth. Closed pieces form the solid; thin shells are surface only. The ground plane belongs to
/// neither. The outer side of an open piece is unknown: the piece is flipped if the volume between it and fans from its
/// border to the border's centre is negative. Cost: two copies of the mesh, three of an open one.
TruthSurface truth_of(const Scene& scene);

/// Which space counts as the volume of the truth.
enum class TruthVolume {
  closed_pieces,  ///< of TruthSurface::solid
  /// The space that TruthSurface::all encloses: air (a flood fill) from above and from the sides, through cells as wide as
  /// the columns' spacing, does not reach it. For meshes of thin shells and with holes, as vehicles often are. Holes wider
  /// than the spacing let air in, so the spacing may have to be raised. The mesh stands on the ground: space that is open
  /// below is filled.
  enclosed,
  /// The part of the truth's box where the generalised winding number of TruthSurface::wound exceeds 1/2 (Jacobson, Kavan &
  /// Sorkine-Hornung 2013). Holes are closed approximately by the flattest surface over them.
  winding_number,
  none,  ///< undefined: only surfaces are compared
};

/// "closed pieces", "enclosed", "winding number", "none".
std::string_view name(TruthVolume volume);

struct ScoreOptions {
  /// Spacing of the vertical lines along which volumes are measured (m). 0: 1/512 of the longer horizontal side of the
  /// box around both surfaces.
  double column_spacing_m = 0.0;
  TruthVolume truth_volume = TruthVolume::closed_pieces;
  std::size_t n_samples = 100'000;  ///< points on each surface from which distances are taken
  Monitor monitor;
};

struct TruthVolumeChoice {
  TruthVolume volume = TruthVolume::closed_pieces;
  std::string reason;  ///< one line for the user; empty if all pieces are closed
};

/// Chooses the volume of a truth: `closed_pieces` if all pieces are closed. Else `enclosed` if that volume changes by no more
/// than 5 % when the cells are twice as wide, and is at least half of that by winding number, where this is defined. Else
/// `winding_number`, or `none` if it is undefined: if more than 5 % of the samples in the truth's box have a winding number
/// farther than 0.25 from an integer, or none has one above 1/2. Cells are as wide as `column_spacing_m` of the options;
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
  /// Volume of the intersection over that of the union; 0 when either solid is empty. This, the next two and the true
  /// volume are not measured for TruthVolume::none.
  double iou = 0.0;
  double precision = 0.0;  ///< fraction of the extracted volume that is true; 0 when either solid is empty
  double recall = 0.0;     ///< fraction of the true volume that was extracted; 0 when either solid is empty
  double volume_m3 = 0.0;  ///< of the extracted solid
  double truth_volume_m3 = 0.0;
  double volume_error = kNotMeasured;  ///< (extracted − true) / true volume; not measured without a true volume
  /// Volume that only one of both solids holds, over the area of the true surface: a mean thickness of the errors (m).
  double symmetric_difference_m = kNotMeasured;
  /// IoU without hidden space: what is empty in truth, lies above the truth's lowest point, and is reached by no ray of a view
  /// before the true surface. Not measured without views.
  double observable_iou = kNotMeasured;
  /// IoU of the truth with itself and all hidden space in its box: what carving by perfect images would leave.
  double hull_iou = kNotMeasured;

  glm::dvec3 box_min_error_m{kNotMeasured};  ///< extracted minus true box, lower corner per axis, world axes
  glm::dvec3 box_max_error_m{kNotMeasured};  ///< the same of the upper corner
  /// Diagonal of the extracted box over that of the true one. Far from 1 when the two are in different units; 0 for
  /// an empty extracted surface, not measured for an empty truth.
  double size_ratio = kNotMeasured;

  SurfaceDistances whole;    ///< over the parts of both surfaces that are not buried
  SurfaceDistances visible;  ///< over the parts of these that some view sees
  /// Mean distances from the visible true surface to the extracted one: where some view sees it alone, and where two surfaces or more
  /// share its pixel in every view that sees it (layover). `laid_over_fraction`: by area, of the visible true surface.
  double completeness_alone_m = kNotMeasured, completeness_laid_over_m = kNotMeasured;
  double laid_over_fraction = kNotMeasured;
  /// Median angle (rad) between the normals of the true surface, where some view sees it, and of the extracted one at the nearest
  /// point.
  double normal_error_rad = kNotMeasured;
  double visible_fraction = 0.0;            ///< by area, of the true surface that is not buried
  double extracted_visible_fraction = 0.0;  ///< the same of the extracted surface

  double column_spacing_m = 0.0;  ///< that was used; 0 when both surfaces are empty
  /// Fraction of the vertical lines that meet the solid along which it is not closed. Above 0 the mesh has holes, and
  /// its volume is unreliable.
  double open_fraction = 0.0;
  double truth_open_fraction = 0.0;  ///< the same of the truth; 0 unless its closed pieces were taken
};

/// Compares an extracted surface with the truth.
///
/// Hidden space is measured on a lattice of points, eight spacings of the columns apart.
///
/// Volumes: of the inside (winding number above zero) along a lattice of vertical lines. Overlapping pieces
/// count once; a mesh that faces inward has no volume. By default the truth's volume is that of `solid`, a scene's closed
/// pieces. That is too little if a scene also has thin shells: truth_volume() chooses another.
///
/// Distances: from `n_samples` points a surface, at equal steps of area, always the same ones, without those that are
/// buried in the surface's own solid, as where pieces overlap. A point is visible when in some view it faces the
/// radar (|n·d| > 1e-4; thin shells on either side), lies within the view's rows and bins, and the straight line to
/// the radar, in the row's plane, does not meet the same surface. The truth's points are tested against the
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
/// Cost, on all threads: mostly some microseconds a point for distances and, for each point that no view sees, up to one
/// ray (about 1 µs) for each view that it faces. `enclosed` takes a byte a cell, 134 MB for 512³; `winding_number` takes
/// 2 s for columns of a bunny with 400 border edges on two busy threads.
SurfaceScore score(const SurfaceMesh& extracted, const TruthSurface& truth, std::span<const Acquisition> views,
                   const ScoreOptions& options = {});

}  // namespace sarnerf
