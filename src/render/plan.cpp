// SPDX-License-Identifier: Apache-2.0
#include "plan.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/render/framing.h"
#include "surface/slice.h"
#include "voxel/voxel_view.h"

namespace sarnerf {

namespace {

/// Automatic sampling: rays this fraction of the finer pixel side (see pixel_side_m) apart, and so many slices
/// a row. sar_bench accuracy shows what other values cost and give (README, accuracy against time).
struct Density {
  double ray_spacing_in_pixels;
  int n_sub_rows;
  int least_at_once;       ///< slices that must be traced together
  double seconds_per_ray;  ///< tracing and deposit, on one thread of a 2.5 GHz server core (sar_bench speed)
};
/// What crosses a translucent solid's box besides costs: its faces are found one by one, and its bins
/// integrated (street.json, of which half is trees).
constexpr double kSecondsPerMediaRay = 150e-9;
/// Rays and slices that cross the scene at least, however coarse the pixels: its energy is then right to 1 %.
/// Outlines are found between rays, but not between slices, of which a side may lose or gain one.
constexpr int kLeastRaysAcross = 32;
constexpr int kLeastSlicesAcross = 128;
/// Limits of that, for scenes much smaller than a pixel.
constexpr double kMostRefinedRays = 4096.0, kMostRefinedSlices = 65536.0;
constexpr Density kSurfaceDensity{0.25, 9, 1, 60e-9};
// How far a volume's surface moves from slice to slice is seen by two at least.
constexpr Density kVoxelDensity{1.0, 2, 2, 1000e-9};

/// Rays resolve range: where rows are narrower than this part of a bin, they need not be as dense as rows.
constexpr double kFinestInBins = 0.125;

/// Pixels that a scene reaches from its centre at most. Its coordinates there are single precision's, 2⁻²⁴ of
/// them: 0.02 of a pixel at this limit. (docs/results/extreme.md has the errors.)
constexpr double kFarthestInPixels = 262'144.0;

/// Rays that a worker traces at once, unless one slice has more.
constexpr std::uint64_t kMostRaysAtOnce = 1 << 18;

/// Tables of a view by elevation: directions, origins, ground.
constexpr std::uint64_t kViewBytesPerRay = 132;

/// Clearing a row's bins and converting them, with the ground's closed form the most.
constexpr double kSecondsPerPixel = 10e-9;
/// Directions, origins and ground of an elevation, made once a view on one thread.
constexpr double kSecondsPerTableEntry = 200e-9;

/// A thread's stack and what its allocator keeps in reserve.
constexpr std::uint64_t kWorkerBytes = 1'000'000;

void check_radar_position(const Scene& scene, const Acquisition& a) {
  const RadarFrame frame = radar_frame(a);
  const glm::dvec3 radar_m = a.aim_m - a.slant_range_m * frame.k;
  if (scene.ground && radar_m.y <= scene.ground->height_m) {
    throw GeometryError(format("the radar stands at %.6g m, below the ground at %.6g m: raise "
                               "--altitude or check --aim and --ground-height",
                               radar_m.y, scene.ground->height_m));
  }
  if (scene.box.empty()) return;
  const VisibleExtent extent(a, scene.box);
  if (extent.range_offsets_m().first <= -a.slant_range_m) {
    throw GeometryError(format("the scene reaches behind the radar, which is %.6g m from the aim "
                               "point: raise --altitude or check units and --scale",
                               a.slant_range_m));
  }
}

/// What the spacing of rays is measured in (m).
double pixel_side_m(const Acquisition& a) {
  return std::min(a.range_spacing_m, std::max(a.azimuth_spacing_m, kFinestInBins * a.range_spacing_m));
}

void check_reach(const Scene& scene, const Acquisition& a) {
  if (scene.box.empty()) return;
  const double reach_m = 0.5 * glm::length(scene.box.size());
  const double finer_m = std::min(a.range_spacing_m, a.azimuth_spacing_m);
  if (reach_m <= kFarthestInPixels * finer_m) return;
  throw GeometryError(format("the scene reaches %.4g m from its centre, %.3g pixels of %.4g m; in single precision "
                             "262144 are the limit: check --units and --scale, cut it down to what the image shows, widen --spacing, or use "
                             "--ground instead of a large plane",
                             reach_m, reach_m / finer_m, finer_m));
}

struct KeptRays {
  std::uint64_t n = 0;
  std::uint64_t widest = 0;  ///< of any one slice
  std::uint64_t n_rows = 0;  ///< that have any
};

/// Rays of the plan that may meet a box.
KeptRays count_rays_to(const Box& box, const ViewPlan& plan) {
  if (box.empty()) return {};
  const Acquisition& a = plan.acquisition;
  const VisibleExtent extent(a, box);
  double kept = 0.0, widest = 0.0;
  std::uint64_t n_rows = 0;
  // Every row's first slice stands for all of its slices: exact enough for a plan.
  for (int i = 0; i < a.n_azimuth; ++i) {
    const double along_m = a.row_offset_m(i);
    const auto angles = extent.angles(along_m, along_m);
    if (!angles) continue;
    const double n = (angles->second - angles->first) / plan.fan.step_rad + 1.0;
    const double n_in_fan = std::min(n, double(plan.fan.n_elevation));
    kept += n_in_fan * plan.n_sub_rows;
    ++n_rows;
    widest = std::max(widest, n_in_fan);
  }
  return {static_cast<std::uint64_t>(kept), static_cast<std::uint64_t>(widest) + 2, n_rows};
}

/// The rays of a lattice of angles through the aim point that cover the extent. Anchored there and not
/// at the extent's border, so that turning scene and radar together, or adding something elsewhere,
/// does not move the rays.
Fan lattice_fan(std::pair<double, double> extent_rad, double step_rad) {
  const double first = std::floor(extent_rad.first / step_rad);
  const double last = std::ceil(extent_rad.second / step_rad);
  if (!(last - first <= 1e8)) {
    throw GeometryError(format("the view needs %.3g elevation rays, 1e8 are the limit: check units, "
                               "--scale and --spacing, or give --elevations",
                               last - first));
  }
  return {first * step_rad, step_rad, std::max(1, static_cast<int>(last - first))};
}

/// Slices a row so that enough of them cross the scene, whose rows may be few.
int slices_across(const Scene& scene, const Acquisition& a, int n_sub_rows) {
  if (scene.box.empty()) return n_sub_rows;
  const RadarFrame frame = radar_frame(a);
  const double along_m = glm::dot(scene.box.size(), glm::abs(frame.h));
  const double wanted = along_m > 0.0 ? std::ceil(kLeastSlicesAcross * a.azimuth_spacing_m / along_m) : 0.0;
  const double most = kMostRefinedSlices / a.n_azimuth;
  return std::max(n_sub_rows, static_cast<int>(std::min(wanted, most)));
}

/// Spacing of rays so that enough of them cross the scene's angular extent, out of `fan_rad` in all.
double spacing_across(const std::optional<std::pair<double, double>>& scene_rad, double fan_rad,
                      double slant_range_m, double spacing_m) {
  if (!scene_rad || !(scene_rad->second > scene_rad->first)) return spacing_m;
  const double wanted_m = (scene_rad->second - scene_rad->first) * slant_range_m / kLeastRaysAcross;
  const double finest_m = fan_rad * slant_range_m / kMostRefinedRays;
  return std::min(spacing_m, std::max(wanted_m, finest_m));
}

void add_left_out_of_plan(const ViewPlan& plan, std::vector<std::string>& lines) {
  if (const std::string unknown = why_error_is_unknown(plan); !unknown.empty()) {
    lines.push_back("the error estimate: " + unknown);
  }
  if (plan.n_grid_rays <= plan.n_kept_rays) return;
  lines.push_back(format("%.1f %% of the ray grid: those rays miss the scene's box",
                         100.0 * double(plan.n_grid_rays - plan.n_kept_rays) /
                             double(plan.n_grid_rays)));
}

std::vector<std::string> left_out_of_volume(const Scene& scene, const Volume& volume,
                                            const ViewPlan& plan) {
  std::vector<std::string> lines;
  if (!scene.ground) lines.push_back("ground: none asked for, so no plane and no rays beyond the scene's box");
  if (!volume.channels.two_extinctions) {
    lines.push_back("a second extinction: it is the same going in and coming back");
  }
  if (volume.channels.basis == SourceBasis::harmonics && volume.channels.harmonics_degree < 2) {
    lines.push_back(format("harmonics above degree %d: the volume has none",
                           volume.channels.harmonics_degree));
  }
  lines.push_back("empty voxels, and all behind an optical depth of 20: not sampled");
  add_left_out_of_plan(plan, lines);
  return lines;
}

std::vector<std::string> left_out(const Scene& scene, const ViewPlan& plan) {
  std::vector<std::string> lines;
  const bool media = std::any_of(scene.materials.begin(), scene.materials.end(),
                                 [](const Material& m) { return !m.opaque; });
  if (!scene.ground) {
    lines.push_back("ground: none asked for, so no plane and no rays beyond the scene's box");
  } else if (scene.materials[scene.ground->material].texture.kind == Texture::Kind::none) {
    lines.push_back("rays for the ground: it is uniform, its image is known in closed form");
  }
  if (!media) lines.push_back("volume integration: all matter is opaque, first hits are enough");
  add_left_out_of_plan(plan, lines);
  return lines;
}

/// Threads that work at the same time: those beyond the processors wait for each other.
double n_cores() {
  return std::min(thread_count(), std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
}

/// All of a plan that does not depend on the engine.
ViewPlan plan_rays(const Scene& scene, const Acquisition& acquisition, const Sampling& sampling,
                   const Density& density) {
  validate(acquisition);
  check_radar_position(scene, acquisition);
  ViewPlan plan;
  plan.acquisition = acquisition;
  plan.integrator = sampling.integrator;
  plan.n_sub_rows = sampling.n_sub_rows > 0 ? sampling.n_sub_rows
                                            : slices_across(scene, acquisition, density.n_sub_rows);
  if (sampling.n_sub_rows == 0) {
    plan.chosen.push_back(format("%d slices per azimuth row%s (--sub-rows)", plan.n_sub_rows,
                                 plan.n_sub_rows > density.n_sub_rows ? ": the scene is only a few rows wide" : ""));
  }

  const Acquisition& a = plan.acquisition;
  std::optional<std::pair<double, double>> angles;
  if (!scene.box.empty()) angles = VisibleExtent(a, scene.box).angles(a.row_offset_m(-0.5), a.row_offset_m(a.n_azimuth - 0.5));
  const std::optional<std::pair<double, double>> scene_angles = angles;
  if (scene.ground) {
    if (const auto ground = ground_angular_extent(a, scene.ground->height_m)) {
      angles = angles ? std::pair{std::min(angles->first, ground->first),
                                  std::max(angles->second, ground->second)}
                      : *ground;
    }
  }
  // The image, and the coarser one from which its error is estimated.
  plan.memory_bytes = 2 * std::uint64_t(a.n_azimuth) * std::uint64_t(a.n_range) * sizeof(float);
  if (!angles) {
    plan.fan.n_elevation = 0;
    plan.left_out.push_back("everything: no ray meets the scene inside the swath");
    return plan;
  }

  const double dense_m = density.ray_spacing_in_pixels * pixel_side_m(a);
  const double spacing_m = sampling.ray_spacing_m > 0.0 ? sampling.ray_spacing_m
                           : spacing_across(scene_angles, angles->second - angles->first, a.slant_range_m, dense_m);
  // A scene without any extent across the rays still needs one.
  const double least = 1e-3 * spacing_m / a.slant_range_m;
  if (angles->second - angles->first < least) {
    angles = std::pair{angles->first - least, angles->second + least};
  }
  if (sampling.n_elevation > 0) {
    plan.fan = make_fan(*angles, sampling.n_elevation);
  } else {
    plan.fan = lattice_fan(*angles, spacing_m / a.slant_range_m);
    plan.chosen.push_back(
        sampling.ray_spacing_m > 0.0
            ? format("%d elevation rays, %.4g m apart", plan.fan.n_elevation, spacing_m)
        : spacing_m < dense_m
            ? format("%d elevation rays, %.4g m apart: the scene is only a few pixels wide (--elevations)",
                     plan.fan.n_elevation, spacing_m)
            : format("%d elevation rays, %.4g m apart: %.2g of the finer pixel side (--elevations)",
                     plan.fan.n_elevation, spacing_m, density.ray_spacing_in_pixels));
  }
  const auto n_elevation = static_cast<std::uint64_t>(plan.fan.n_elevation);
  plan.n_grid_rays = std::uint64_t(a.n_azimuth) * std::uint64_t(plan.n_sub_rows) * n_elevation;
  const KeptRays kept = count_rays_to(scene.box, plan);
  plan.n_kept_rays = std::min(plan.n_grid_rays, kept.n);
  plan.n_widest_slice = std::min(n_elevation, kept.widest);
  plan.n_scene_slices = kept.n_rows * static_cast<std::uint64_t>(plan.n_sub_rows);
  // By the plan alone, never by threads or memory: which slices are traced together shows in last digits.
  const auto room = static_cast<int>(kMostRaysAtOnce / std::max<std::uint64_t>(plan.n_widest_slice, 1));
  const int most = std::min(static_cast<int>(RayTracer::kRowsPerBlock), plan.n_sub_rows);
  plan.n_slices_at_once = std::clamp(room, std::min(density.least_at_once, most), most);
  plan.memory_bytes += n_elevation * kViewBytesPerRay + std::uint64_t(thread_count()) * kWorkerBytes;
  plan.expected_s = (double(plan.n_kept_rays) * density.seconds_per_ray +
                     double(a.n_azimuth) * double(a.n_range) * kSecondsPerPixel) / n_cores() +
                    double(n_elevation) * kSecondsPerTableEntry;
  return plan;
}

/// Of a row being made: sums, groups, votes.
constexpr std::uint64_t kLayerBytesPerBin = 140;

}  // namespace

ViewPlan plan_view(const Scene& scene, const Box& media_m, const Acquisition& acquisition,
                   const Sampling& sampling) {
  check_reach(scene, acquisition);
  ViewPlan plan = plan_rays(scene, acquisition, sampling, kSurfaceDensity);
  if (plan.fan.n_elevation == 0) return plan;
  plan.left_out = left_out(scene, plan);
  std::uint64_t worker_bytes =
      plan.n_widest_slice * static_cast<std::uint64_t>(plan.n_slices_at_once) * kSliceBytesPerRay;
  if (scene.ground && scene.materials[scene.ground->material].texture.kind != Texture::Kind::none) {
    worker_bytes += std::uint64_t(plan.fan.n_elevation) * kBareSliceBytesPerRay;
  }
  plan.expected_s += double(count_rays_to(media_m, plan).n) * kSecondsPerMediaRay / n_cores();
  plan.memory_bytes += worker_bytes * static_cast<std::uint64_t>(thread_count());
  return plan;
}

ViewPlan plan_voxel_view(const Scene& scene, const Volume& volume, const Acquisition& acquisition,
                         const Sampling& sampling) {
  // Rays and slices a voxel apart see what the voxels have.
  Density density = kVoxelDensity;
  density.ray_spacing_in_pixels = std::min(density.ray_spacing_in_pixels,
                                           volume.grid.transform().voxel_size_m / pixel_side_m(acquisition));
  const double slices = std::ceil(acquisition.azimuth_spacing_m / volume.grid.transform().voxel_size_m);
  density.n_sub_rows = std::max(density.n_sub_rows, static_cast<int>(std::min(slices, 64.0)));
  ViewPlan plan = plan_rays(scene, acquisition, sampling, density);
  if (plan.fan.n_elevation == 0) return plan;
  plan.left_out = left_out_of_volume(scene, volume, plan);
  const std::uint64_t n_packed = plan.n_widest_slice * static_cast<std::uint64_t>(plan.n_slices_at_once);
  // No ray is longer than the box; half as much again for cuts at borders of bins and bricks.
  const double length_m = scene.box.empty() ? 0.0 : glm::length(scene.box.size());
  const double most_per_ray = 1.5 * length_m / (volume.longest_segment * volume.grid.transform().voxel_size_m) + 2.0;
  const double n_segments = std::min(double(n_packed) * most_per_ray,
                                     double(kMostSegments) + 16.0 * plan.n_slices_at_once * most_per_ray);
  const std::uint64_t worker_bytes =
      n_packed * kPackedBytesPerRay + static_cast<std::uint64_t>(n_segments) * kBytesPerSegment;
  plan.memory_bytes += worker_bytes * static_cast<std::uint64_t>(thread_count());
  return plan;
}

std::string why_error_is_unknown(const ViewPlan& plan) {
  // A ground alone has no box; its rays are those of the whole view, or none.
  const bool ground_alone = plan.n_scene_slices == 0;
  const std::uint64_t n_rays = ground_alone ? static_cast<std::uint64_t>(plan.fan.n_elevation) : plan.n_widest_slice;
  const std::uint64_t n_slices = ground_alone ? std::uint64_t(plan.acquisition.n_azimuth) * static_cast<std::uint64_t>(plan.n_sub_rows)
                                              : plan.n_scene_slices;
  if (plan.fan.n_elevation == 0 || (n_rays >= kFewestForError && n_slices >= kFewestForError)) return {};
  const bool rays = n_rays < kFewestForError;
  return (rays ? counted(n_rays, "elevation ray") : counted(n_slices, "slice")) +
         " across the scene" + ((rays ? n_rays : n_slices) == 1 ? " tells" : " tell") + " nothing of it, " + std::to_string(kFewestForError) +
         " are needed (" + (rays ? "--elevations" : "--sub-rows") + ")";
}

void request_layers(ViewPlan& plan, const LayerRequest& request) {
  plan.layers = request;
  plan.error.map = request.layers.has(Layer::error);
  if (request.layers.empty()) {
    plan.left_out.push_back("layers: not asked for");
    return;
  }
  const Acquisition& a = plan.acquisition;
  const std::uint64_t n_pixels = std::uint64_t(a.n_azimuth) * std::uint64_t(a.n_range);
  plan.memory_bytes += n_pixels * bytes_per_pixel(request.layers) +
                       std::uint64_t(a.n_range) * kLayerBytesPerBin * std::uint64_t(thread_count());
}

std::uint64_t expected_engine_memory_bytes(std::uint64_t n_triangles) {
  // Embree's build peaks near 200 bytes a triangle, plus our copies: the process that renders a million triangles
  // (sar_bench speed, "large_image") peaks at 248 MB, image and program included.
  return 20'000'000 + n_triangles * 240;
}

namespace {

bool has_media(const Scene& scene) {
  return std::any_of(scene.mesh.material.begin(), scene.mesh.material.end(),
                     [&](std::uint32_t m) { return !scene.materials[m].opaque; });
}

/// All integrators but `exact` lose what cells scatter whose optical depth is large: exp(-103) is zero in
/// single precision, and few cells are cut short enough to escape.
bool vanishes_by_integrator(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence) {
  if (plan.integrator == Integrator::exact) return false;
  if (evidence.volume) return evidence.n_hits > 0;
  constexpr double kDense = 40.0;
  return std::any_of(scene.mesh.material.begin(), scene.mesh.material.end(), [&](std::uint32_t n) {
    const Material& m = scene.materials[n];
    const double two_way_per_m = m.extinction_per_m + m.extinction_back_per_m;
    return !m.opaque && m.scattering_per_m > 0.0 && two_way_per_m * plan.acquisition.range_spacing_m > kDense;
  });
}

}  // namespace

std::string explain_blank(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence) {
  const std::string swath = outside_swath_warning(scene, plan.acquisition);
  if (plan.fan.n_elevation == 0) {
    return "the image is blank: " +
           (swath.empty() ? std::string("no ray meets the scene inside the swath; check --aim and --size") : swath);
  }
  const bool all_dark = !evidence.volume && std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) {
    return m.opaque ? m.gamma0 == 0.0 : m.scattering_per_m == 0.0;
  });
  if (all_dark) {
    return "the image is blank: every material in use scatters nothing (gamma0 or scattering_per_m is "
           "0); see --materials";
  }
  if (vanishes_by_integrator(scene, plan, evidence)) {
    return "the image is blank: --integrator " + std::string(name(plan.integrator)) +
           " attenuates what a cell scatters by its own optical depth, and here cells are so dense that "
           "nothing is left; use --integrator exact";
  }
  if (!swath.empty()) {
    return "the image is blank: what it holds is shadow, or turned away from the radar; " + swath;
  }
  if (evidence.volume && evidence.n_hits > 0) {
    return "the image is blank: rays met the volume, but what they met scatters nothing, or lies outside the "
           "swath";
  }
  if (evidence.n_hits == 0 && has_media(scene)) {
    return "the image is blank: no ray met a face, and translucent solids gave nothing; the scene may be "
           "smaller than the spacing of the rays (--scale, --units, --spacing), or too thin to scatter";
  }
  if (evidence.n_hits == 0) {
    return "the image is blank: no ray met a triangle; the scene may be smaller than the spacing of "
           "the rays, check --scale, --units and --spacing";
  }
  return "the image is blank: rays met the scene, but only faces that show no backscatter to the radar "
         "(turned away, or dark materials) or that lie outside the swath";
}

}  // namespace sarnerf
