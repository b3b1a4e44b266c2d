// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/surface_engine.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>

#include "appearance.h"
#include "blank.h"
#include "corner_reflector.h"
#include "ground_plane.h"
#include "layer_row.h"
#include "media.h"
#include "plan.h"
#include "reconstruct.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "slice.h"
#include "triangle_section.h"
#include "triangle_subset.h"
#include "view_rays.h"
#include "visible_extent.h"

namespace sarnerf {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::vector<std::uint32_t> opaque_triangles(const Scene& scene) {
  std::vector<std::uint32_t> chosen;
  chosen.reserve(scene.mesh.triangles.size());
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.materials[scene.mesh.material[t]].opaque) chosen.push_back(t);
  }
  return chosen;
}

std::size_t count_open_media(const Scene& scene) {
  std::size_t n = 0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    n += !scene.materials[scene.mesh.material[t]].opaque && !scene.pieces[scene.mesh.piece[t]].closed;
  }
  return n;
}

/// Scratch of one worker.
struct Worker {
  SliceBlock block;
  Slice bare;  ///< meets nothing but the ground
  MediaScratch media_scratch;
  std::vector<double> bins, ground_bins;
  std::optional<LayerRow> layers;
  std::uint64_t n_hits = 0;
};

}  // namespace

struct SurfaceEngine::State {
  const Scene& scene;
  glm::dvec3 origin_m;  ///< of the scene frame, in which Embree works
  AppearanceTable appearances;
  TriangleSubset opaque;
  std::unique_ptr<RayTracer> tracer;
  Media media;
  std::vector<std::string> warnings;
  double build_s = 0.0;

  /// Of the triangles in `opaque`; found when layers are asked for the first time.
  std::span<const Component> components() const {
    std::call_once(components_found_, [&] {
      const std::vector<Component> all = components_of_triangles(scene);
      for (const std::uint32_t t : opaque_triangles(scene)) components_.push_back(all[t]);
    });
    return components_;
  }

  explicit State(const Scene& s)
      : scene(s), origin_m(s.box.empty() ? glm::dvec3(0.0) : s.box.centre()), media(s, origin_m) {
    const std::vector<std::uint32_t> chosen = opaque_triangles(s);
    appearances = make_appearances(s, chosen, origin_m);
    opaque = take_triangles(s.mesh, chosen, origin_m);
    tracer = std::make_unique<RayTracer>(vertices(opaque.vertices_m), opaque.triangles);
    if (std::string corners = corner_reflector_warning(s); !corners.empty()) {
      warnings.push_back(std::move(corners));
    }
    if (const std::size_t n = count_open_media(s); n > 0) {
      warnings.push_back(std::to_string(n) +
                         " translucent triangles bound no volume and have no effect: close the "
                         "mesh, or give it an opaque material");
    }
  }

 private:
  mutable std::once_flag components_found_;
  mutable std::vector<Component> components_;
};

SurfaceEngine::SurfaceEngine(const Scene& scene) {
  if (scene.mesh.triangles.empty() && !scene.ground) {
    throw GeometryError("the scene has neither triangles nor a ground: there is nothing to render");
  }
  const auto start = std::chrono::steady_clock::now();
  state_ = std::make_unique<State>(scene);
  state_->build_s = seconds_since(start);
}

SurfaceEngine::~SurfaceEngine() = default;

const std::vector<std::string>& SurfaceEngine::warnings() const { return state_->warnings; }

double SurfaceEngine::build_s() const { return state_->build_s; }

std::uint64_t SurfaceEngine::memory_bytes() const {
  return state_->tracer->memory_bytes() + state_->media.memory_bytes() +
         state_->opaque.vertices_m.size() * sizeof(glm::vec3) +
         state_->opaque.triangles.size() * (sizeof(glm::uvec3) + sizeof(std::uint16_t));
}

ViewPlan SurfaceEngine::plan(const Acquisition& acquisition, const Sampling& sampling) const {
  return plan_view(state_->scene, state_->media.box_m(), acquisition, sampling);
}

RenderedView SurfaceEngine::render(const ViewPlan& plan, const Monitor& monitor) const {
  const auto start = std::chrono::steady_clock::now();
  const State& state = *state_;
  const Acquisition& a = plan.acquisition;
  RenderedView view;
  view.beta0 = Image<float>(a.n_azimuth, a.n_range);
  view.layers = Layers(plan.layers.layers, a.n_azimuth, a.n_range);
  if (plan.fan.n_elevation == 0) {
    view.warnings.push_back(explain_blank(state.scene, plan, BlankEvidence{}));
    return view;
  }

  const VisibleExtent extent(a, state.scene.box.empty() ? Box{a.aim_m, a.aim_m} : state.scene.box);
  const ViewRays rays(a, plan.fan, state.origin_m, extent.range_offsets_m());
  const TriangleSections sections(rays, vertices(state.opaque.vertices_m), state.opaque.triangles,
                                  state.origin_m);
  std::optional<GroundPlane> ground;
  if (state.scene.ground) {
    ground.emplace(rays,
                   ground_of_view(ground_appearance(state.scene, state.origin_m), a,
                                  a.aim_m - state.origin_m),
                   state.scene.ground->height_m);
  }
  const SliceScene slice_scene{rays, sections, state.appearances,
                               ground ? &ground->appearance() : nullptr};
  std::optional<VisibleExtent> media_extent;
  if (!state.media.empty()) media_extent.emplace(a, state.media.box_m());
  std::optional<LayerView> layer_view;
  std::span<const Component> components;
  if (!plan.layers.layers.empty()) {
    layer_view.emplace(a, plan.fan, plan.layers.reference_height_m);
    components = state.components();
  }
  const auto sink = [&](Worker& w) { return LayerSink{w.layers ? &*w.layers : nullptr, components}; };
  const double slice_width_m = a.azimuth_spacing_m / plan.n_sub_rows;
  const int n_el = plan.fan.n_elevation;

  // Bare ground to both sides of the rays that may meet the mesh.
  const auto render_ground_around = [&](const RayRange& kept, const Slice& beside, Worker& w) {
    Slice& slice = w.bare;
    slice.along_m = beside.along_m;
    slice.width_m = beside.width_m;
    const int end = kept.first + kept.count;
    if (ground->uniform()) {
      ground->deposit_outside(kept.first - 1, kept.count > 0 ? end : -2, w.bins);
      if (w.layers) {
        w.ground_bins.assign(w.bins.size(), 0.0);
        ground->deposit_outside(kept.first - 1, kept.count > 0 ? end : -2, w.ground_bins);
        w.layers->add_ground(w.ground_bins);
      }
      return;
    }
    ground->fill_alone(0, kept.count > 0 ? std::max(0, kept.first - 1) : n_el, slice);
    deposit_slice(slice, slice_scene, w.bins, sink(w));
    if (kept.count == 0 || end >= n_el) return;
    ground->fill_alone(end + 1, std::max(0, n_el - end - 1), slice);
    deposit_slice(slice, slice_scene, w.bins, sink(w));
  };

  // Neighbouring slices, of one row, centred on the given along-track coordinates.
  const auto render_slices = [&](double first_along_m, std::size_t n_slices, Worker& w) {
    SliceBlock& block = w.block;
    block.n_slices = n_slices;
    for (std::size_t s = 0; s < n_slices; ++s) {
      block.slices[s].along_m = first_along_m + double(s) * slice_width_m;
      block.slices[s].width_m = slice_width_m;
    }
    std::optional<std::pair<double, double>> angles;
    const double last_along_m = first_along_m + double(n_slices - 1) * slice_width_m;
    if (!state.scene.box.empty()) angles = extent.angles(first_along_m, last_along_m);
    const RayRange kept = rays_inside(plan.fan, angles);
    if (kept.count > 0) {
      w.n_hits += trace_slices(*state.tracer, rays, state.appearances, kept.first, kept.count, block);
    }
    RayRange through_media;
    if (media_extent) {
      through_media = rays_inside(plan.fan, media_extent->angles(first_along_m, last_along_m));
    }
    const auto render_kept = [&](Slice& slice) {
      if (ground) {
        ground->fill(slice);
      } else {
        slice.surface.front() = kNoTriangle;
        slice.surface[static_cast<std::size_t>(kept.count) + 1] = kNoTriangle;
      }
      if (through_media.count > 0) {
        state.media.apply(rays, plan.integrator, through_media.first,
                          through_media.first + through_media.count, slice, w.media_scratch, w.bins,
                          w.layers ? &*w.layers : nullptr);
      }
      deposit_slice(slice, slice_scene, w.bins, sink(w));
    };
    for (std::size_t s = 0; s < n_slices; ++s) {
      if (w.layers) w.layers->begin_slice();
      if (ground) render_ground_around(kept, block.slices[s], w);
      if (kept.count > 0) render_kept(block.slices[s]);
      if (w.layers) w.layers->end_slice();
    }
  };

  std::vector<Worker> workers(static_cast<std::size_t>(thread_count()));
  if (layer_view) {
    for (Worker& w : workers) w.layers.emplace(*layer_view, plan.layers.layers);
  }
  // β⁰ = (r_j Δθ / Δr) × sum over k, averaged over the row's slices.
  std::vector<double> beta0_per_mass;
  for (int j = 0; j < a.n_range; ++j) {
    beta0_per_mass.push_back(plan.fan.step_rad / (a.range_spacing_m * plan.n_sub_rows) * a.range_m(j));
  }
  std::atomic<std::size_t> n_rows_done{0};
  const auto render_rows = [&](std::size_t begin, std::size_t end, int worker) {
    Worker& w = workers[static_cast<std::size_t>(worker)];
    for (std::size_t i = begin; i < end; ++i) {
      monitor.check();
      w.bins.assign(static_cast<std::size_t>(a.n_range), 0.0);
      if (w.layers) w.layers->begin_row();
      const double row_start_m = a.row_offset_m(static_cast<double>(i) - 0.5);
      const int n_at_once = plan.n_slices_at_once;
      for (int sub = 0; sub < plan.n_sub_rows; sub += n_at_once) {
        monitor.check();  // a row may have thousands of slices
        render_slices(row_start_m + (sub + 0.5) * slice_width_m,
                      static_cast<std::size_t>(std::min(n_at_once, plan.n_sub_rows - sub)), w);
      }
      const auto row = view.beta0.row(static_cast<int>(i));
      for (std::size_t j = 0; j < row.size(); ++j) row[j] = static_cast<float>(w.bins[j] * beta0_per_mass[j]);
      if (w.layers) w.layers->end_row(static_cast<int>(i), beta0_per_mass, view.layers);
      // One worker reports for all: reports must not overlap.
      const std::size_t done = ++n_rows_done;
      if (worker == 0) monitor.report("rendering rows", done, static_cast<std::uint64_t>(a.n_azimuth));
    }
  };
  parallel_for(static_cast<std::size_t>(a.n_azimuth), 1, render_rows);

  for (const Worker& w : workers) view.n_hits += w.n_hits;
  view.trace_and_deposit_s = seconds_since(start);
  if (std::none_of(view.beta0.pixels().begin(), view.beta0.pixels().end(),
                   [](float p) { return p > 0.0f; })) {
    view.warnings.push_back(explain_blank(state.scene, plan, BlankEvidence{view.n_hits}));
  }
  return view;
}

}  // namespace sarnerf
