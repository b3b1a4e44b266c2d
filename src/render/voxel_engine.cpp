// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/voxel_engine.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "appearance.h"
#include "blank.h"
#include "deposit.h"
#include "footprint.h"
#include "ground_rays.h"
#include "plan.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/trace/box_tracer.h"
#include "view_rays.h"
#include "visible_rays.h"
#include "volume_boxes.h"

namespace sarnerf {
namespace {

/// Longest segment, in voxels: the field is linear over less than that.
constexpr double kLongestSegment = 0.5;

/// Segments that emit less than this part of what lies before them on their ray are left out.
constexpr double kLeastPart = 1e-7;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int n_extinctions(const FieldChannels& channels) { return channels.first_source(); }

/// Channel beside the extinctions that scatters by itself, or −1.
int scattering_channel(const FieldChannels& channels) {
  return channels.basis == SourceBasis::scattering ? channels.first_source() : -1;
}

/// Rays of one slice packed for tracing.
struct PackedRow {
  std::vector<float> origin_x, origin_y, origin_z, direction_x, direction_y, direction_z;
  std::vector<float> distance, normal_x, normal_y, normal_z;
  std::vector<std::uint32_t> box;

  void resize(std::size_t n) {
    for (auto* array : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z,
                        &distance, &normal_x, &normal_y, &normal_z}) {
      array->resize(n);
    }
    box.resize(n);
  }
  RayRow rays(float far_m) const {
    return {origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, far_m};
  }
  HitRow hits() { return {distance, normal_x, normal_y, normal_z, box}; }
};

/// Scratch of one worker.
struct Worker {
  Worker(const BrickView<const float>& grid, const FieldChannels& channels, const Occupancy& occupancy,
         double longest_m)
      : marcher(grid, channels, occupancy, longest_m) {}

  VolumeMarcher marcher;
  SampleBatch batch;
  BatchField field;
  std::array<PackedRow, RayTracer::kRowsPerBlock> rows;
  std::array<SliceEmission, RayTracer::kRowsPerBlock> emission;
  std::vector<bool> consecutive;  ///< packed rays n and n + 1 are neighbours
  std::vector<double> contributions, bins, ground_bins;
  std::vector<SegmentEmission> emitted;  ///< per segment
  std::uint64_t n_hits = 0;
};

}  // namespace

struct VoxelEngine::State {
  const Scene& scene;
  Volume volume;
  Occupancy occupancy;
  std::vector<Box> boxes_m;  ///< world coordinates
  glm::dvec3 origin_m;       ///< of the scene frame, in which Embree works
  std::optional<BoxTracer> tracer;
  std::optional<Appearance> ground;
  std::vector<std::string> warnings;
  double build_s = 0.0;

  State(const Scene& s, Volume v)
      : scene(s),
        volume(std::move(v)),
        occupancy(volume.grid.view(), n_extinctions(volume.channels),
                  scattering_channel(volume.channels)),
        boxes_m(volume_boxes_m(occupancy, volume.grid.transform())),
        origin_m(volume.support_m.empty() ? glm::dvec3(0.0) : volume.support_m.centre()) {
    std::vector<BoxTracer::FloatBox> boxes;
    for (const Box& box : boxes_m) {
      boxes.push_back({glm::vec3(box.min - origin_m), glm::vec3(box.max - origin_m)});
    }
    if (!boxes.empty()) tracer.emplace(boxes);
    if (s.ground) ground = ground_appearance(s, origin_m);
  }

  /// The box that contains all that a view may see: the scene as the plan takes it.
  Scene planned() const {
    Scene view;
    view.box = volume.support_m;
    view.ground = scene.ground;
    view.materials = scene.materials;
    return view;
  }

  std::vector<Box> boxes_from(const glm::dvec3& aim_m) const {
    std::vector<Box> boxes = boxes_m;
    for (Box& box : boxes) box = {box.min - aim_m, box.max - aim_m};
    return boxes;
  }
};

VoxelEngine::VoxelEngine(const Scene& scene, Volume volume) {
  if (volume.n_occupied_voxels == 0 && !scene.ground) {
    throw GeometryError("the volume has no voxel with extinction or scattering, and there is no ground: "
                        "there is nothing to render");
  }
  const auto start = std::chrono::steady_clock::now();
  state_ = std::make_unique<State>(scene, std::move(volume));
  state_->build_s = seconds_since(start);
}

VoxelEngine::~VoxelEngine() = default;

const std::vector<std::string>& VoxelEngine::warnings() const { return state_->warnings; }
double VoxelEngine::build_s() const { return state_->build_s; }

std::uint64_t VoxelEngine::memory_bytes() const {
  return state_->volume.memory_bytes() + state_->occupancy.memory_bytes() +
         state_->boxes_m.size() * sizeof(Box) +
         (state_->tracer ? state_->tracer->memory_bytes() : 0);
}

ViewPlan VoxelEngine::plan(const Acquisition& acquisition, const Sampling& sampling) const {
  return plan_voxel_view(state_->planned(), state_->volume, acquisition, sampling);
}

RenderedView VoxelEngine::render(const ViewPlan& plan, const Monitor& monitor) const {
  const auto start = std::chrono::steady_clock::now();
  const State& state = *state_;
  const Acquisition& a = plan.acquisition;
  RenderedView view;
  view.beta0 = Image<float>(a.n_azimuth, a.n_range);
  const Scene planned = state.planned();
  if (plan.fan.n_elevation == 0) {
    view.warnings.push_back(explain_blank(planned, plan, BlankEvidence{}));
    return view;
  }
  const Box seen = planned.box.empty() ? Box{a.aim_m, a.aim_m} : planned.box;
  const VisibleExtent extent(a, seen);
  const VisibleRays visible(a, plan.fan, state.boxes_from(a.aim_m));

  const ViewRays rays(a, plan.fan, state.origin_m, extent.range_offsets_m());
  std::optional<GroundRays> ground;
  std::vector<double> bare_ground(static_cast<std::size_t>(a.n_range), 0.0);  // of all slices of a row
  if (state.ground) {
    ground.emplace(rays, *state.ground, state.scene.ground->height_m);
    if (ground->uniform()) {
      for (int k = 0; k < plan.fan.n_elevation; ++k) {
        ground->deposit(k, 0.0, plan.n_sub_rows, bare_ground);
      }
    }
  }
  const bool uniform_ground = ground && ground->uniform();

  BrickView<const float> grid = state.volume.grid.view();
  grid.transform.origin_m -= a.aim_m;
  const double voxel_m = grid.transform.voxel_size_m;
  // Embree's entry is in single precision: begin a little before it.
  const double entry_margin_m = 0.02 * voxel_m;
  const double slice_width_m = a.azimuth_spacing_m / plan.n_sub_rows;

  // Marches the rays of one slice that entered matter. What they see of the ground goes into ground_bins:
  // all of it, or, where the bare ground is known, what is missing of it.
  const auto march_slice = [&](double along_m, std::span<const RayRange> ranges,
                               const PackedRow& packed, SliceEmission& emission, Worker& w) {
    std::size_t n = 0;
    for (const RayRange& range : ranges) {
      for (int k = range.first; k < range.first + range.count; ++k, ++n) {
        double depth = 0.0;
        if (packed.box[n] != kNoTriangle) {
          RangeInterval interval{rays.start_offset_m + double(packed.distance[n]) - entry_margin_m,
                                 rays.start_offset_m + double(rays.far_m)};
          if (ground) interval.far_m = std::min(interval.far_m, ground->offset_m(k));
          emission.batch_ray[n] = static_cast<std::uint32_t>(w.batch.n_rays());
          depth = w.marcher.march(rays.grid, along_m, 0, k, interval, w.batch, w.field);
          w.n_hits += depth > 0.0;
        }
        if (!ground) continue;
        const double passed = depth < kEndOfRayDepth ? std::exp(-depth) : 0.0;
        if (!uniform_ground) {
          ground->deposit(k, along_m, passed, w.ground_bins);
        } else if (passed < 1.0) {
          ground->deposit(k, along_m, passed - 1.0, w.ground_bins);
        }
      }
    }
  };

  const double bins_per_m = 1.0 / a.range_spacing_m;
  const bool two_extinctions = state.volume.channels.two_extinctions;
  const auto emission_of_segment = [&](const Worker& w, std::size_t q) {
    const double length_m = w.batch.length_m[q];
    const double forth = w.field.extinction_per_m[q];
    const double back = two_extinctions ? double(w.field.extinction_back_per_m[q]) : forth;
    return segment_emission(w.field.near_bin[q], length_m * bins_per_m, length_m * (forth + back));
  };

  // Places what a block of slices emits on the row's bins.
  const auto deposit_block = [&](std::size_t n_slices, std::size_t n_rays, Worker& w) {
    w.contributions.resize(w.batch.n_segments());
    w.emitted.resize(w.batch.n_segments());
    contributions(spans(w.batch), samples(w.field, state.volume.channels.basis), plan.integrator,
                  w.contributions);
    for (std::size_t s = 0; s < n_slices; ++s) {
      SliceEmission& emission = w.emission[s];
      for (std::size_t n = 0; n < n_rays; ++n) {
        const std::uint32_t ray = emission.batch_ray[n];
        if (ray == SliceEmission::kNoRay) continue;
        double mass = 0.0, moment = 0.0;
        for (std::size_t q = w.batch.ray_begin[ray]; q < w.batch.ray_begin[ray + 1]; ++q) {
          const double c = w.contributions[q];
          if (!(c > kLeastPart * mass)) continue;
          w.emitted[q] = emission_of_segment(w, q);
          mass += c;
          moment += c * w.emitted[q].bin;
        }
        emission.mass[n] = mass;
        emission.centroid[n] = mass > 0.0 ? moment / mass : 0.0;
      }
    }
    const Footprints footprints(std::span(w.emission).first(n_slices), w.consecutive);
    for (std::size_t s = 0; s < n_slices; ++s) {
      const SliceEmission& emission = w.emission[s];
      for (std::size_t n = 0; n < n_rays; ++n) {
        if (!(emission.mass[n] > 0.0)) continue;
        const RangeSpan over_ray = footprints.over_ray(s, n);
        const double over_slice = footprints.over_slice(s, n);
        const std::uint32_t ray = emission.batch_ray[n];
        double mass = 0.0;
        for (std::size_t q = w.batch.ray_begin[ray]; q < w.batch.ray_begin[ray + 1]; ++q) {
          const double c = w.contributions[q];
          if (!(c > kLeastPart * mass)) continue;
          mass += c;
          const SegmentEmission& at = w.emitted[q];
          deposit_trapezoid(w.bins, at.bin + over_ray.first, at.bin + over_ray.last,
                            over_slice + at.width, c);
        }
      }
    }
    w.batch.clear();
    w.field.clear();
  };

  const auto pack = [&](double along_m, std::span<const RayRange> ranges, std::size_t n_rays,
                        PackedRow& packed) {
    const glm::dvec3 shift = along_m * rays.grid.frame().h;
    packed.resize(n_rays);
    std::size_t n = 0;
    for (const RayRange& range : ranges) {
      for (int k = range.first; k < range.first + range.count; ++k, ++n) {
        const auto m = static_cast<std::size_t>(k);
        packed.origin_x[n] = static_cast<float>(rays.origin_x[m] + shift.x);
        packed.origin_y[n] = static_cast<float>(rays.origin_y[m] + shift.y);
        packed.origin_z[n] = static_cast<float>(rays.origin_z[m] + shift.z);
        packed.direction_x[n] = rays.direction_x[m];
        packed.direction_y[n] = rays.direction_y[m];
        packed.direction_z[n] = rays.direction_z[m];
      }
    }
  };

  // The ground between rays that meet matter, where it is not known in closed form.
  const auto deposit_bare_ground = [&](double along_m, std::span<const RayRange> ranges,
                                       std::span<double> bins) {
    int k = 0;
    for (const RayRange& range : ranges) {
      for (; k < range.first; ++k) ground->deposit(k, along_m, 1.0, bins);
      k = range.first + range.count;
    }
    for (; k < plan.fan.n_elevation; ++k) ground->deposit(k, along_m, 1.0, bins);
  };

  std::vector<std::unique_ptr<Worker>> workers;
  for (int n = 0; n < thread_count(); ++n) {
    workers.push_back(std::make_unique<Worker>(grid, state.volume.channels, state.occupancy,
                                               kLongestSegment * voxel_m));
  }
  std::atomic<std::size_t> n_rows_done{0};
  const auto render_row = [&](int i, Worker& w) {
    w.bins.assign(static_cast<std::size_t>(a.n_range), 0.0);
    w.ground_bins = bare_ground;
    const std::span<const RayRange> ranges = visible.row(i);
    std::size_t n_rays = 0;
    for (const RayRange& range : ranges) n_rays += static_cast<std::size_t>(range.count);
    w.consecutive.assign(n_rays, true);
    std::size_t end = 0;
    for (const RayRange& range : ranges) w.consecutive[(end += static_cast<std::size_t>(range.count)) - 1] = false;
    const double first_along_m = a.row_offset_m(static_cast<double>(i) - 0.5) + 0.5 * slice_width_m;
    constexpr int kBlock = static_cast<int>(RayTracer::kRowsPerBlock);
    for (int first = 0; first < plan.n_sub_rows; first += kBlock) {
      const auto n_slices = static_cast<std::size_t>(std::min(kBlock, plan.n_sub_rows - first));
      const auto along_m = [&](std::size_t s) {
        return first_along_m + (first + static_cast<int>(s)) * slice_width_m;
      };
      std::array<RayRow, RayTracer::kRowsPerBlock> rows;
      std::array<HitRow, RayTracer::kRowsPerBlock> hits;
      for (std::size_t s = 0; s < n_slices; ++s) {
        pack(along_m(s), ranges, n_rays, w.rows[s]);
        rows[s] = w.rows[s].rays(rays.far_m);
        hits[s] = w.rows[s].hits();
        w.emission[s].assign(n_rays);
        if (ground && !uniform_ground) deposit_bare_ground(along_m(s), ranges, w.ground_bins);
      }
      if (n_rays == 0) continue;
      state.tracer->entries(std::span(rows).first(n_slices), std::span(hits).first(n_slices));
      for (std::size_t s = 0; s < n_slices; ++s) {
        march_slice(along_m(s), ranges, w.rows[s], w.emission[s], w);
      }
      deposit_block(n_slices, n_rays, w);
    }
    // β⁰ = (r_j Δθ / Δr) × sum over k, averaged over the row's slices.
    const double factor = plan.fan.step_rad / (a.range_spacing_m * plan.n_sub_rows);
    const auto row = view.beta0.row(i);
    for (int j = 0; j < a.n_range; ++j) {
      const auto n = static_cast<std::size_t>(j);
      // What of the ground all rays together hide is hidden but for rounding.
      const double ground_seen = w.ground_bins[n] > 1e-12 * bare_ground[n] ? w.ground_bins[n] : 0.0;
      row[n] = static_cast<float>((w.bins[n] + ground_seen) * factor * a.range_m(j));
    }
  };
  const auto render_rows = [&](std::size_t begin, std::size_t end, int worker) {
    for (std::size_t i = begin; i < end; ++i) {
      monitor.check();
      render_row(static_cast<int>(i), *workers[static_cast<std::size_t>(worker)]);
      // One worker reports for all: reports must not overlap.
      const std::size_t done = ++n_rows_done;
      if (worker == 0) monitor.report("rendering rows", done, static_cast<std::uint64_t>(a.n_azimuth));
    }
  };
  parallel_for(static_cast<std::size_t>(a.n_azimuth), 1, render_rows);

  for (const auto& w : workers) view.n_hits += w->n_hits;
  view.trace_and_deposit_s = seconds_since(start);
  if (std::none_of(view.beta0.pixels().begin(), view.beta0.pixels().end(),
                   [](float p) { return p > 0.0f; })) {
    view.warnings.push_back(explain_blank(planned, plan, BlankEvidence{view.n_hits}));
  }
  return view;
}

}  // namespace sarnerf
