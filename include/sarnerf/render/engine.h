// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/render/layers.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

/// What a render is to say about its own error.
struct ErrorRequest {
  bool estimate = true;
  bool map = false;           ///< a value per pixel, too
  bool by_direction = false;  ///< elevation rays and slices apart, too
};

/// What a render says about its own error E = ‖I − I*‖₂ / ‖I*‖₂, I* the limit of infinitely many rays and
/// slices and of vanishing voxels of the same scene: found from coarser samplings contained in it. Not a
/// bound: docs/method/sampling_error.md shows how far to trust it. NaN where it is not known.
struct ErrorEstimate {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double relative = kUnknown;     ///< E
  double elevation = kUnknown;    ///< part of it that more elevation rays would mend
  double along_track = kUnknown;  ///< part of it that more slices a row would mend
  Image<float> map;               ///< expected |I − I*| of each pixel; an engine moves it to Layers::error
};

/// How densely a view is sampled. Zero means: choose.
struct Sampling {
  int n_elevation = 0;
  int n_sub_rows = 0;          ///< slices per azimuth row
  Integrator integrator = Integrator::exact;  ///< matters for translucent solids only
  double ray_spacing_m = 0.0;  ///< at the aim point's range, instead of a number of elevation rays
};

/// What rendering one view will take; made before any of it is done.
struct ViewPlan {
  Acquisition acquisition;
  Fan fan;
  int n_sub_rows = 1;
  int n_slices_at_once = 1;  ///< of a row, traced together: fewer where there are many rays, for memory
  Integrator integrator = Integrator::exact;
  LayerRequest layers;            ///< none unless the caller sets it
  ErrorRequest error;             ///< an estimate of the image's error unless the caller unsets it
  std::uint64_t n_grid_rays = 0;  ///< rows × sub-rows × elevations
  std::uint64_t n_kept_rays = 0;  ///< rays that meet the scene's box: the only ones generated
  std::uint64_t n_widest_slice = 0;  ///< most rays of one slice that meet the scene's box
  std::uint64_t n_scene_slices = 0;  ///< slices of all rows that meet it
  std::uint64_t memory_bytes = 0; ///< image and scratch, without scene and BVH
  double expected_s = 0.0;        ///< rough, from the number of kept rays
  std::vector<std::string> chosen;    ///< settings chosen automatically, and why
  std::vector<std::string> left_out;  ///< what this scene does not need
};

/// Rays and slices across the scene that an error estimate needs: of the sampling three times coarser from which it comes,
/// two are left in either direction.
inline constexpr std::uint64_t kFewestForError = 6;

/// Why a plan's error cannot be estimated: "5 elevation rays meet the scene …"; empty when it can.
std::string why_error_is_unknown(const ViewPlan& plan);

/// One rendered view.
struct RenderedView {
  Image<float> beta0;  ///< radar brightness, linear power, [n_azimuth × n_range]
  Layers layers;       ///< those that the plan asks for
  ErrorEstimate error;
  std::uint64_t n_hits = 0;
  double trace_and_deposit_s = 0.0;
  std::vector<std::string> warnings;  ///< a blank image says why here
};

/// Asks for layers beside the image of a planned view: counts their memory, says what is left out. Layer::error
/// sets the plan's error request.
void request_layers(ViewPlan& plan, const LayerRequest& request);

/// What makes images of a scene: built once, then used for any number of views, on any number of threads.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  /// The plan of a view. Throws GeometryError when the view is impossible for this scene.
  virtual ViewPlan plan(const Acquisition& acquisition, const Sampling& sampling) const = 0;

  /// Renders with all threads that parallel_for has; the result does not depend on their number.
  virtual RenderedView render(const ViewPlan& plan, const Monitor& monitor = {}) const = 0;

  /// What the user should know about images of this scene, whatever the view.
  virtual const std::vector<std::string>& warnings() const = 0;

  /// Bytes of acceleration structures and of the engine's copy of the scene.
  virtual std::uint64_t memory_bytes() const = 0;
  /// Seconds that the constructor took.
  virtual double build_s() const = 0;
};

/// MPA of a mesh by ray casting: opaque matter by first hits, translucent solids in closed form between
/// entry and exit. Built once, then used for any number of views.
class SurfaceEngine final : public Engine {
 public:
  /// Builds the acceleration structure. `scene` must outlive the engine. Throws GeometryError for a scene without
  /// triangles and ground.
  explicit SurfaceEngine(const Scene& scene);
  ~SurfaceEngine() override;

  ViewPlan plan(const Acquisition& acquisition, const Sampling& sampling) const override;
  RenderedView render(const ViewPlan& plan, const Monitor& monitor = {}) const override;
  const std::vector<std::string>& warnings() const override;
  std::uint64_t memory_bytes() const override;
  double build_s() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Bytes that the engine of a scene with this many triangles is expected to need while it is built.
std::uint64_t expected_engine_memory_bytes(std::uint64_t n_triangles);

/// MPA of a sparse volume: Embree finds where each ray enters occupied matter, the ray is cut into segments
/// there and nowhere else, and their contributions are those of mpa::integrate, as in training. Each ray's
/// contributions are spread over the range that its step of angle covers (departure from the paper, whose
/// rays are points: it would need some hundred rays a pixel for the same evenness).
class VoxelEngine final : public Engine {
 public:
  /// `scene` gives the ground and the box to be framed, and must outlive the engine; its mesh is not looked
  /// at. `coarse`, the same scene in voxels of twice the size, lets views estimate what their voxels cost in
  /// accuracy; without it a volume counts as the truth, and estimates tell of the sampling alone. Throws
  /// GeometryError when there is neither matter nor a ground.
  explicit VoxelEngine(const Scene& scene, Volume volume, std::optional<Volume> coarse = {});
  ~VoxelEngine() override;

  ViewPlan plan(const Acquisition& acquisition, const Sampling& sampling) const override;
  RenderedView render(const ViewPlan& plan, const Monitor& monitor = {}) const override;
  const std::vector<std::string>& warnings() const override;
  std::uint64_t memory_bytes() const override;
  double build_s() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A render on the way to a tolerance.
struct ToleranceStep {
  int n_elevation = 0, n_sub_rows = 0;
  double estimate = 0.0;  ///< of E
  double seconds = 0.0;
};

/// A view that says of itself that it meets a tolerance.
struct TolerantView {
  RenderedView view;
  ViewPlan plan;       ///< as rendered
  bool met = true;     ///< false after kMostAttempts
  std::vector<ToleranceStep> steps;  ///< all renders, the last one is this view
};
inline constexpr std::size_t kMostAttempts = 5;

/// The cheapest sampling that is expected to meet a tolerance.
struct ToleranceChoice {
  Sampling sampling;        ///< ray spacing and slices a row; good for similar views of the scene, too
  std::vector<ToleranceStep> steps;
  std::optional<TolerantView> met;  ///< the last pilot, if it met the tolerance already
};

/// Renders a view coarsely, with its error by direction, ever finer until the step that is left is short enough
/// to trust a prediction: errors fall with a power of the spacing in either direction. Of all samplings that are
/// expected to meet the tolerance, the one with the fewest rays is chosen. `tolerance` is E, between 0 and 1; above
/// 5 % images know too little of their error, and what meets 5 % is made instead. Cost: a tenth to a third of the
/// view that it chooses.
ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                Integrator integrator = Integrator::exact, const Monitor& monitor = {});

/// Renders a view as planned and, while its own estimate is above the tolerance, again with finer sampling. A
/// blank view, whose error is not known, counts as met.
TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor = {});

}  // namespace sarnerf
