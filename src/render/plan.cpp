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

/// Automatic sampling: ray spacing as a fraction of the finer pixel side (see pixel_side_m), and slices a row.
/// sar_bench accuracy shows the time and error of other values (README, accuracy against time).
struct Density {
  double ray_spacing_in_pixels;
  int n_slices;
  int least_at_once;       ///< slices that must be traced together
  double seconds_per_ray;  ///< tracing and deposit, on one thread of a 2.5 GHz server core (sar_bench speed)
};
/// Additional cost of a ray that meets the box of the translucent solids: their faces are found one by one, and the
/// bins are integrated. Measured on street.json, half of which is trees.
constexpr double kSecondsPerMediaRay = 150e-9;
/// Smallest numbers of rays and slices across the scene, however coarse the pixels: its energy is then right to 1 %.
/// Outlines are located between rays but not between slices: at each side one slice may be lost or gained.
constexpr int kLeastRaysAcross = 32;
constexpr int kLeastSlicesAcross = 128;
/// Upper limits of this refinement, for scenes much smaller than a pixel.
constexpr double kMostRefinedRays = 4096.0, kMostRefinedSlices = 65536.0;
constexpr Density kSurfaceDensity{0.25, 9, 1, 60e-9};
// At least two slices are needed to find how far a volume's surface moves from slice to slice.
constexpr Density kVoxelDensity{1.0, 2, 2, 1000e-9};

/// Ray spacing resolves range: rows narrower than this fraction of a bin do not make it finer.
constexpr double kFinestInBins = 0.125;

/// Largest reach of a scene from its centre, in pixels. Coordinates are in single precision: the relative rounding of
/// 2⁻²⁴ is 0.02 of a pixel at this limit. (docs/results/extreme.md has the errors.)
constexpr double kFarthestInPixels = 262'144.0;

/// Most rays that a worker traces at once, unless one slice has more.
constexpr std::uint64_t kMostRaysAtOnce = 1 << 18;

/// Tables of a view, per elevation ray: directions, origins, ground.
constexpr std::uint64_t kViewBytesPerRay = 132;

/// Clearing a row's bins and converting them; the ground's closed form takes most of it.
constexpr double kSecondsPerPixel = 10e-9;
/// Directions, origins and ground of one elevation ray, computed once a view on one thread.
constexpr double kSecondsPerTableEntry = 200e-9;

/// A thread's stack and what its allocator keeps in reserve.
constexpr std::uint64_t kWorkerBytes = 1'000'000;

void check_radar_position(const Scene& scene, const Acquisition& a) {
  const RadarFrame frame = radar_frame(a);
  const glm::dvec3 radar_m = a.aim_m - a.slant_range_m * frame.k;
  if (scene.ground && radar_m.y <= scene.ground->height_m) {
    throw GeometryError(format("the radar is at %.6g m, below the ground at %.6g m: raise "
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

/// The finer pixel side, to which the spacing of rays is relative (m).
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
  std::uint64_t widest = 0;    ///< most rays of any one slice
  std::uint64_t n_slices = 0;  ///< slices that meet the box
};

/// Rays of the plan that may meet a box.
KeptRays count_rays_to(const Box& box, const ViewPlan& plan) {
  if (box.empty()) return {};
  const Acquisition& a = plan.acquisition;
  const VisibleExtent extent(a, box);
  const auto [box_first_m, box_last_m] = extent.along_track_m();
  const double slice_m = a.azimuth_spacing_m / plan.n_slices;
  double kept = 0.0, widest = 0.0, n_slices = 0.0;
  for (int i = 0; i < a.n_azimuth; ++i) {
    const double row_m = a.row_offset_m(i - 0.5), first_m = std::max(box_first_m, row_m),
                 last_m = std::min(box_last_m, a.row_offset_m(i + 0.5));
    if (!(first_m <= last_m)) continue;
    // One position represents all slices of the row: exact enough for a plan.
    const double along_m = std::clamp(a.row_offset_m(i), first_m, last_m);
    const auto angles = extent.angles(along_m, along_m);
    if (!angles) continue;
    const double n_in_fan = std::min((angles->second - angles->first) / plan.fan.step_rad + 1.0, double(plan.fan.n_elevation));
    const double n_of_row = std::floor((last_m - row_m) / slice_m) - std::floor((first_m - row_m) / slice_m) + 1.0;
    const double n_here = std::min(n_of_row, double(plan.n_slices));
    kept += n_in_fan * n_here;
    n_slices += n_here;
    widest = std::max(widest, n_in_fan);
  }
  return {static_cast<std::uint64_t>(kept), static_cast<std::uint64_t>(widest) + 2, static_cast<std::uint64_t>(n_slices)};
}

/// The rays of a lattice of angles that cover the extent. The lattice is anchored at the aim point and not at
/// the extent's border, so that rotating scene and radar together, or adding objects elsewhere, does not
/// move the rays.
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

/// Slices a row so that at least kLeastSlicesAcross of them cross the scene, which may span only a few rows.
int slices_across(const Scene& scene, const Acquisition& a, int n_slices) {
  if (scene.box.empty()) return n_slices;
  const RadarFrame frame = radar_frame(a);
  const double along_m = glm::dot(scene.box.size(), glm::abs(frame.h));
  const double wanted = along_m > 0.0 ? std::ceil(kLeastSlicesAcross * a.azimuth_spacing_m / along_m) : 0.0;
  const double most = kMostRefinedSlices / a.n_azimuth;
  return std::max(n_slices, static_cast<int>(std::min(wanted, most)));
}

/// Spacing of rays so that at least kLeastRaysAcross of them cross the scene's angular extent; `fan_rad` is the extent
/// of the whole fan.
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
  if (!scene.ground) lines.push_back("ground: not requested, so no plane and no rays beyond the scene's box");
  if (!volume.channels.two_extinctions) {
    lines.push_back("a second extinction: it is the same going in and coming back");
  }
  if (volume.channels.basis == SourceBasis::harmonics && volume.channels.harmonics_degree < 2) {
    lines.push_back(format("harmonics above degree %d: the volume has none",
                           volume.channels.harmonics_degree));
  }
  lines.push_back("empty voxels, and voxels behind a two-way optical depth of 20: not sampled");
  add_left_out_of_plan(plan, lines);
  return lines;
}

std::vector<std::string> left_out(const Scene& scene, const ViewPlan& plan) {
  std::vector<std::string> lines;
  const bool media = std::any_of(scene.materials.begin(), scene.materials.end(),
                                 [](const Material& m) { return !m.opaque; });
  if (!scene.ground) {
    lines.push_back("ground: not requested, so no plane and no rays beyond the scene's box");
  } else if (scene.materials[scene.ground->material].texture.kind == Texture::Kind::none) {
    lines.push_back("rays for the ground: it is uniform, its image is known in closed form");
  }
  if (!media) lines.push_back("volume integration: all materials are opaque, first hits are enough");
  add_left_out_of_plan(plan, lines);
  return lines;
}

/// Threads that run at the same time: at most the number of processors. Plans are also made inside a parallel loop.
double n_cores() {
  return std::min(most_threads(), std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
}

/// The part of a plan that does not depend on the engine.
ViewPlan plan_rays(const Scene& scene, const Acquisition& acquisition, const Sampling& sampling,
                   const Density& density) {
  validate(acquisition);
  check_radar_position(scene, acquisition);
  ViewPlan plan;
  plan.acquisition = acquisition;
  plan.integrator = sampling.integrator;
  plan.n_slices = sampling.n_slices > 0 ? sampling.n_slices
                                            : slices_across(scene, acquisition, density.n_slices);
  if (sampling.n_slices == 0) {
    plan.chosen.push_back(format("%d slices per azimuth row%s (--sub-rows)", plan.n_slices,
                                 plan.n_slices > density.n_slices ? ": the scene is only a few rows wide" : ""));
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
  // The image, and the coarser image for its error estimate.
  plan.memory_bytes = 2 * std::uint64_t(a.n_azimuth) * std::uint64_t(a.n_range) * sizeof(float);
  if (!angles) {
    plan.fan.n_elevation = 0;
    plan.left_out.push_back("everything: no ray meets the scene inside the swath");
    return plan;
  }

  const double dense_m = density.ray_spacing_in_pixels * pixel_side_m(a);
  const double spacing_m = sampling.ray_spacing_m > 0.0 ? sampling.ray_spacing_m
                           : spacing_across(scene_angles, angles->second - angles->first, a.slant_range_m, dense_m);
  // A scene of no angular extent still needs rays: widen it.
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
  plan.n_grid_rays = std::uint64_t(a.n_azimuth) * std::uint64_t(plan.n_slices) * n_elevation;
  const KeptRays kept = count_rays_to(scene.box, plan);
  plan.n_kept_rays = std::min(plan.n_grid_rays, kept.n);
  plan.n_widest_slice = std::min(n_elevation, kept.widest);
  plan.n_scene_slices = kept.n_slices;
  // This depends on the plan alone, never on threads or memory: which slices are traced together changes last digits.
  const auto room = static_cast<int>(kMostRaysAtOnce / std::max<std::uint64_t>(plan.n_widest_slice, 1));
  const int most = std::min(static_cast<int>(RayTracer::kRowsPerBlock), plan.n_slices);
  plan.n_slices_at_once = std::clamp(room, std::min(density.least_at_once, most), most);
  plan.memory_bytes += n_elevation * kViewBytesPerRay;
  plan.worker_bytes = kWorkerBytes;
  plan.expected_s = (double(plan.n_kept_rays) * density.seconds_per_ray +
                     double(a.n_azimuth) * double(a.n_range) * kSecondsPerPixel) / n_cores() +
                    double(n_elevation) * kSecondsPerTableEntry;
  return plan;
}

/// Scratch of the row under way: sums, groups, votes.
constexpr std::uint64_t kLayerBytesPerBin = 140;

}  // namespace

ViewPlan plan_view(const Scene& scene, const Box& media_m, const Acquisition& acquisition,
                   const Sampling& sampling) {
  check_reach(scene, acquisition);
  ViewPlan plan = plan_rays(scene, acquisition, sampling, kSurfaceDensity);
  if (plan.fan.n_elevation == 0) return plan;
  plan.left_out = left_out(scene, plan);
  plan.worker_bytes +=
      plan.n_widest_slice * static_cast<std::uint64_t>(plan.n_slices_at_once) * kSliceBytesPerRay;
  if (scene.ground && scene.materials[scene.ground->material].texture.kind != Texture::Kind::none) {
    plan.worker_bytes += std::uint64_t(plan.fan.n_elevation) * kBareSliceBytesPerRay;
  }
  plan.expected_s += double(count_rays_to(media_m, plan).n) * kSecondsPerMediaRay / n_cores();
  return plan;
}

ViewPlan plan_voxel_view(const Scene& scene, const Volume& volume, const Acquisition& acquisition,
                         const Sampling& sampling) {
  // Rays and slices one voxel apart resolve everything that the voxels contain.
  Density density = kVoxelDensity;
  density.ray_spacing_in_pixels = std::min(density.ray_spacing_in_pixels,
                                           volume.grid.transform().voxel_size_m / pixel_side_m(acquisition));
  const double slices = std::ceil(acquisition.azimuth_spacing_m / volume.grid.transform().voxel_size_m);
  density.n_slices = std::max(density.n_slices, static_cast<int>(std::min(slices, 64.0)));
  ViewPlan plan = plan_rays(scene, acquisition, sampling, density);
  if (plan.fan.n_elevation == 0) return plan;
  plan.left_out = left_out_of_volume(scene, volume, plan);
  const std::uint64_t n_packed = plan.n_widest_slice * static_cast<std::uint64_t>(plan.n_slices_at_once);
  // No ray is longer than the box's diagonal; the factor 1.5 allows for cuts at borders of bins and bricks.
  const double length_m = scene.box.empty() ? 0.0 : glm::length(scene.box.size());
  const double most_per_ray = 1.5 * length_m / (volume.longest_segment * volume.grid.transform().voxel_size_m) + 2.0;
  const double n_segments = std::min(double(n_packed) * most_per_ray,
                                     double(kMostSegments) + 16.0 * plan.n_slices_at_once * most_per_ray);
  plan.worker_bytes += n_packed * kPackedBytesPerRay + static_cast<std::uint64_t>(n_segments) * kBytesPerSegment;
  return plan;
}

std::string why_error_is_unknown(const ViewPlan& plan) {
  // A ground alone has no box: the rays and slices are those of the whole view.
  const bool ground_alone = plan.n_scene_slices == 0;
  const std::uint64_t n_rays = ground_alone ? static_cast<std::uint64_t>(plan.fan.n_elevation) : plan.n_widest_slice;
  const std::uint64_t n_slices = ground_alone ? std::uint64_t(plan.acquisition.n_azimuth) * static_cast<std::uint64_t>(plan.n_slices)
                                              : plan.n_scene_slices;
  if (plan.fan.n_elevation == 0 || (n_rays >= kFewestForError && n_slices >= kFewestForError)) return {};
  const bool rays = n_rays < kFewestForError;
  return (rays ? counted(n_rays, "elevation ray") : counted(n_slices, "slice")) +
         " across the scene" + ((rays ? n_rays : n_slices) == 1 ? " gives" : " give") + " no estimate, " +
         std::to_string(kFewestForError) + " are needed (" + (rays ? "--elevations" : "--sub-rows") + ")";
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
  plan.memory_bytes += n_pixels * bytes_per_pixel(request.layers);
  plan.worker_bytes += std::uint64_t(a.n_range) * kLayerBytesPerBin;
}

std::uint64_t expected_engine_memory_bytes(std::uint64_t n_triangles) {
  // Embree's build peaks near 200 bytes a triangle; our copies come on top. The process that renders a million
  // triangles (sar_bench speed, "large_image") peaks at 248 MB, image and program included.
  return 20'000'000 + n_triangles * 240;
}

namespace {

bool has_media(const Scene& scene) {
  return std::any_of(scene.mesh.material.begin(), scene.mesh.material.end(),
                     [&](std::uint32_t m) { return !scene.materials[m].opaque; });
}

/// All integrators except `exact` lose the power of cells of large optical depth: exp(-103) is zero in single
/// precision, and few cells are cut short enough to keep any.
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
    return "the image is blank: it holds only shadow, or faces that are turned away from the radar; " + swath;
  }
  if (evidence.volume && evidence.n_hits > 0) {
    return "the image is blank: rays met the volume, but what they met scatters nothing, or lies outside the "
           "swath";
  }
  if (evidence.n_hits == 0 && has_media(scene)) {
    return "the image is blank: no ray met a face, and translucent solids scattered no power into the image; the scene may be "
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
