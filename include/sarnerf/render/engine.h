// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/integrator.h"
#include "sarnerf/render/error_estimate.h"
#include "sarnerf/render/layers.h"

namespace sarnerf {

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

}  // namespace sarnerf
