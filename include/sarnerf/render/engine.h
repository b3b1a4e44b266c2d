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

/// What a render estimates about its own error.
struct ErrorRequest {
  bool estimate = true;
  bool map = false;           ///< also a value per pixel
  bool by_direction = false;  ///< also separately for elevation rays and for slices
};

/// A render's estimate of its own error E = ‖I − I*‖₂ / ‖I*‖₂, where I* is the limit of infinitely many rays and
/// slices and of vanishing voxels of the same scene. It comes from the difference to a coarser sampling: one contained
/// in the view (surface engine), or a second render (voxel engine). Not a bound: docs/method/sampling_error.md shows
/// how reliable it is. NaN where it is not known.
struct ErrorEstimate {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double relative = kUnknown;     ///< E
  double elevation = kUnknown;    ///< part that more elevation rays would reduce
  double along_track = kUnknown;  ///< part that more slices a row would reduce
  Image<float> map;               ///< expected |I − I*| of each pixel; an engine moves it to Layers::error
};

/// How densely a view is sampled. Zero: chosen automatically.
struct Sampling {
  int n_elevation = 0;
  int n_slices = 0;          ///< slices per azimuth row
  Integrator integrator = Integrator::exact;  ///< matters for translucent solids and voxels only
  double ray_spacing_m = 0.0;  ///< at the aim point's range; an alternative to n_elevation
};

/// Sampling and predicted cost of one view, computed before rendering.
struct ViewPlan {
  Acquisition acquisition;
  Fan fan;
  int n_slices = 1;
  int n_slices_at_once = 1;  ///< slices of a row traced together; fewer if slices have many rays, to bound memory
  Integrator integrator = Integrator::exact;
  LayerRequest layers;            ///< none unless the caller sets it
  ErrorRequest error;             ///< an estimate of the image's error unless the caller unsets it
  std::uint64_t n_grid_rays = 0;  ///< rows × sub-rows × elevations
  std::uint64_t n_kept_rays = 0;  ///< rays that meet the scene's box: the only ones traced
  std::uint64_t n_widest_slice = 0;  ///< most rays of one slice that meet the scene's box
  std::uint64_t n_scene_slices = 0;  ///< slices of all rows that meet the scene's box
  std::uint64_t memory_bytes = 0;  ///< image and tables, without scene and BVH, and without worker_bytes
  std::uint64_t worker_bytes = 0;  ///< scratch of each thread that renders the view
  double expected_s = 0.0;         ///< rough, on all threads, from the number of kept rays
  std::vector<std::string> chosen;    ///< settings chosen automatically, and why
  std::vector<std::string> left_out;  ///< what is not computed for this scene, and why
};

/// Rays and slices across the scene that an error estimate needs: the sampling three times coarser then still has two in
/// either direction.
inline constexpr std::uint64_t kFewestForError = 6;

/// Why a plan's error cannot be estimated: "5 elevation rays across the scene …"; empty when it can, or without rays.
std::string why_error_is_unknown(const ViewPlan& plan);

/// One rendered view.
struct RenderedView {
  Image<float> beta0;  ///< radar brightness, linear power, [n_azimuth × n_range]
  Layers layers;       ///< those that the plan asks for
  ErrorEstimate error;
  std::uint64_t n_hits = 0;
  double trace_and_deposit_s = 0.0;
  std::vector<std::string> warnings;  ///< includes the reason why an image is blank
};

/// Adds layers to a plan: adds their memory, or notes in `left_out` that there are none. Layer::error sets
/// plan.error.map.
void request_layers(ViewPlan& plan, const LayerRequest& request);

/// Renders images of a scene: built once, then used for any number of views, on any number of threads.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  /// Plans a view. Throws GeometryError when the view is impossible for this scene.
  virtual ViewPlan plan(const Acquisition& acquisition, const Sampling& sampling) const = 0;

  /// Renders with all threads of parallel_for; the result does not depend on their number.
  virtual RenderedView render(const ViewPlan& plan, const Monitor& monitor = {}) const = 0;

  /// Warnings about this scene that hold for every view.
  virtual const std::vector<std::string>& warnings() const = 0;

  /// Bytes of acceleration structures and of the engine's copy of the scene.
  virtual std::uint64_t memory_bytes() const = 0;
  /// Seconds that the constructor took.
  virtual double build_s() const = 0;
};

/// MPA of a mesh by ray casting: opaque faces by first hits, translucent solids in closed form between
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

/// Expected peak memory (bytes) while the engine of a scene with this many triangles is built.
std::uint64_t expected_engine_memory_bytes(std::uint64_t n_triangles);

/// MPA of a sparse volume: Embree finds where each ray enters occupied voxels, the ray is cut into segments
/// only there, and the contributions are those of mpa::integrate, as in training. Each ray's
/// contributions are spread over the range that its angular step covers. (Departure from the paper, whose
/// rays have no width: it would need some hundred rays a pixel for the same evenness.)
class VoxelEngine final : public Engine {
 public:
  /// `scene` provides the ground and the box to be framed, and must outlive the engine; its mesh is not
  /// used. `coarse` is the same scene in voxels of twice the size: with it views estimate the error due to the
  /// voxel size. Without it the volume counts as exact, and estimates cover the sampling alone. Throws
  /// GeometryError when there is neither an occupied voxel nor a ground.
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

/// One render of the search for a tolerance.
struct ToleranceStep {
  int n_elevation = 0, n_slices = 0;
  double estimate = 0.0;  ///< of E, see ErrorEstimate
  double seconds = 0.0;
};

/// A view rendered until its own error estimate meets a tolerance.
struct TolerantView {
  RenderedView view;
  ViewPlan plan;       ///< as rendered
  bool met = true;     ///< false after kMostAttempts
  std::vector<ToleranceStep> steps;  ///< all renders, the last one is this view
};
inline constexpr std::size_t kMostAttempts = 5;

/// The cheapest sampling that is expected to meet a tolerance.
struct ToleranceChoice {
  Sampling sampling;        ///< ray spacing and slices a row; also suits similar views of the scene
  std::vector<ToleranceStep> steps;
  std::optional<TolerantView> met;  ///< the last pilot, if it already met the tolerance
};

/// Renders coarse pilots of a view with their errors by direction, each finer than the last, until the remaining
/// refinement is small enough for a prediction: errors decrease with a power of the spacing in either direction. Of all
/// samplings that are expected to meet the tolerance, the one with the fewest rays is chosen. `tolerance` is E, between
/// 0 and 1, else UsageError. Above 5 % error estimates are unreliable: 5 % is used instead. Cost: a tenth to a third of
/// the view that it chooses.
ToleranceChoice choose_sampling(const Engine& engine, const Acquisition& acquisition, double tolerance,
                                Integrator integrator = Integrator::exact, const Monitor& monitor = {});

/// Renders a view as planned, then again with finer sampling while its own estimate is above 97 % of the tolerance;
/// kMostAttempts renders at most. A blank view, whose error is not known, counts as met. `tolerance` as in choose_sampling().
TolerantView render_to_tolerance(const Engine& engine, const ViewPlan& plan, double tolerance,
                                 const Monitor& monitor = {});

}  // namespace sarnerf
