// SPDX-License-Identifier: Apache-2.0
#include "surface/reconstruct.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sarnerf/core/units.h"
#include "sarnerf/mpa/deposit.h"

namespace sarnerf {

TriangleSections::TriangleSections(const ViewRays& rays, std::span<const glm::vec3> vertices_m,
                                   std::span<const glm::uvec3> triangles,
                                   const glm::dvec3& scene_origin_m)
    : vertices_m_(vertices_m),
      triangles_(triangles),
      frame_(rays.grid.frame()),
      scene_from_aim_m_(scene_origin_m - rays.grid.acquisition().aim_m),
      slant_range_m_(rays.grid.acquisition().slant_range_m),
      fan_(rays.grid.fan()) {}

std::optional<std::pair<double, double>> TriangleSections::rays_of(std::uint32_t triangle,
                                                                   double along_m) const {
  const glm::uvec3 corners = triangles_[triangle];
  std::array<glm::dvec3, 3> p;  // (along h − a, along v, along k)
  for (int n = 0; n < 3; ++n) {
    const glm::dvec3 q = glm::dvec3(vertices_m_[corners[n]]) + scene_from_aim_m_;
    p[static_cast<std::size_t>(n)] = {glm::dot(q, frame_.h) - along_m, glm::dot(q, frame_.v),
                                      glm::dot(q, frame_.k)};
  }
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (std::size_t n = 0; n < 3; ++n) {
    const glm::dvec3 &from = p[n], &to = p[(n + 1) % 3];
    if ((from.x < 0.0) == (to.x < 0.0)) continue;
    const double fraction = from.x / (from.x - to.x);
    const double v = from.y + fraction * (to.y - from.y);
    const double depth = slant_range_m_ + from.z + fraction * (to.z - from.z);
    const double k = (std::atan2(v, depth) - fan_.first_angle_rad) / fan_.step_rad - 0.5;
    first = std::min(first, k);
    last = std::max(last, k);
  }
  if (!(first <= last)) return std::nullopt;
  return std::pair{first, last};
}

namespace {

double angle(float cosine) { return std::acos(std::min(1.0, std::abs(static_cast<double>(cosine)))); }

}  // namespace

void add_run(const ViewRays& rays, const Slice& slice, const SliceRun& run, const LayerSink& sink) {
  const auto component = [&](std::size_t m) {
    const std::uint32_t surface = slice.surface[m];
    return surface == kGroundSurface ? Component::none : sink.component[surface];
  };
  const double length = static_cast<double>(run.last - run.first) + run.before + run.after;
  for (std::size_t a = run.first; a <= run.last;) {
    const Component here = component(a);
    std::size_t b = a;
    while (b < run.last && component(b + 1) == here) ++b;
    const double before = a == run.first ? run.before : 0.5, after = b == run.last ? run.after : 0.5;
    LayerRun part;
    part.component = here;
    part.mass = length > 0.0 ? run.mass * (static_cast<double>(b - a) + before + after) / length : run.mass;
    // Sample m belongs to ray first + m − 1.
    part.first_ray = slice.first + static_cast<double>(a) - 1.0 - before;
    part.last_ray = slice.first + static_cast<double>(b) - 1.0 + after;
    part.first_bin = slice.bin[a] - before * static_cast<double>(slice.bin_per_ray[a]);
    part.last_bin = slice.bin[b] + after * static_cast<double>(slice.bin_per_ray[b]);
    part.smear = run.smear;
    if (here == Component::none) {
      const double ray = std::midpoint(part.first_ray, part.last_ray);
      part.incidence_rad = rays.grid.acquisition().incidence_rad + rays.grid.fan().ray_angle_rad(ray);
      sink.row->add_ground(part);
    } else {
      part.incidence_rad = std::midpoint(angle(slice.cosine[a]), angle(slice.cosine[b]));
      sink.row->add(part);
      sink.row->hide(here, part.first_ray, part.last_ray, part.first_bin, part.last_bin);
    }
    a = b + 1;
  }
}

namespace {

/// Largest deviation (bins) of a run from the straight line that is deposited for it.
constexpr float kBinTolerance = 0.004f;
/// Largest relative change of γ inside a run. The run's mean γ is exact; this only bounds the error of its distribution.
constexpr float kGammaTolerance = 0.001f;
/// Samples tested together.
constexpr std::size_t kRunBlock = 4;

class Reconstruction {
 public:
  Reconstruction(const Slice& slice, const SliceScene& scene, std::span<double> bins,
                 const LayerSink& layers)
      : s_(slice),
        scene_(scene),
        bins_(bins),
        layers_(layers),
        surface_(slice.surface.data()),
        bin_(slice.bin.data()),
        bin_per_ray_(slice.bin_per_ray.data()),
        bin_per_slice_(slice.bin_per_slice.data()),
        gamma_(slice.gamma.data()) {}

  void run() {
    const auto last = static_cast<std::size_t>(s_.n_rays) + 1;
    // The run that touches the first end sample begins at that sample itself, not half a ray before.
    open(0, 0.0);
    for (std::size_t m = 0; m < last; ++m) {
      m = end_of_run(m, last);
      if (m == last) break;
      if (!present(m) && !present(m + 1)) {
        open(m + 1, 0.0);
        continue;
      }
      const double border = border_after(m);
      close(m, border);
      open(m + 1, 1.0 - border);
    }
    close(last, 0.0);
  }

 private:
  /// Tests whether a sample continues the run that begins at `first`.
  struct RunTest {
    float bin, slope, smear, gamma, smear_tolerance, gamma_tolerance;

    RunTest(const Reconstruction& r, std::size_t first)
        : bin(r.bin_[first]),
          slope(r.bin_per_ray_[first]),
          smear(r.bin_per_slice_[first]),
          gamma(r.gamma_[first]),
          smear_tolerance(kBinTolerance * (1.0f + std::abs(smear))),
          gamma_tolerance(kGammaTolerance * gamma) {}

    /// Not zero if sample n, `step` samples after the first, departs from the run.
    std::uint32_t departs(const Reconstruction& r, std::size_t n, float step) const {
      const float straight = bin + slope * step;
      return std::uint32_t{r.surface_[n] == kNoTriangle} |
             std::uint32_t{!(std::abs(r.bin_[n] - straight) <= kBinTolerance)} |
             std::uint32_t{!(std::abs(r.bin_per_ray_[n] - slope) <= kBinTolerance)} |
             std::uint32_t{!(std::abs(r.bin_per_slice_[n] - smear) <= smear_tolerance)} |
             std::uint32_t{!(std::abs(r.gamma_[n] - gamma) <= gamma_tolerance)};
    }
  };

  bool present(std::size_t m) const { return surface_[m] != kNoTriangle; }

  void open(std::size_t m, double before) {
    first_ = m;
    before_ = before;
    gamma_sum_ = present(m) ? gamma_[m] : 0.0f;
  }

  /// Last sample, from m on, that lies on the plane of the run with the same brightness. This loop
  /// visits every ray: it is hot.
  std::size_t end_of_run(std::size_t m, std::size_t last) {
    if (!present(m)) return m;
    const RunTest test(*this, first_);
    float gamma_sum = 0.0f;
    // Whole blocks without an inner branch, so that the compiler vectorises them; then single samples.
    for (; m + kRunBlock <= last; m += kRunBlock) {
      const auto step = static_cast<float>(m - first_);
      std::uint32_t departs = 0;
      for (std::uint32_t i = 1; i <= kRunBlock; ++i) {
        departs |= test.departs(*this, m + i, step + static_cast<float>(static_cast<int>(i)));
      }
      if (departs != 0) break;
      for (std::uint32_t i = 1; i <= kRunBlock; ++i) gamma_sum += gamma_[m + i];
    }
    for (; m < last; ++m) {
      if (test.departs(*this, m + 1, static_cast<float>(m + 1 - first_)) != 0) break;
      gamma_sum += gamma_[m + 1];
    }
    gamma_sum_ += gamma_sum;
    return m;
  }

  /// Ends the run `after` of a ray step beyond sample m, and deposits it.
  void close(std::size_t m, double after) const {
    if (!present(m)) return;
    const double gamma_first = gamma_[first_], gamma_last = gamma_[m];
    const double mass = m == first_ ? gamma_first * (before_ + after)
                                    : gamma_sum_ + (before_ - 0.5) * gamma_first +
                                          (after - 0.5) * gamma_last;
    const double smear = 0.5 * (bin_per_slice_[first_] + bin_per_slice_[m]);
    if (layers_.row != nullptr) {
      add_run(scene_.rays, s_, {first_, m, before_, after, mass, smear}, layers_);
    }
    if (!(mass > 0.0)) return;
    const double x_first = bin_[first_] - before_ * bin_per_ray_[first_];
    const double x_last = bin_[m] + after * bin_per_ray_[m];
    deposit_trapezoid(bins_, x_first, x_last, smear, mass);
  }

  /// Where the surface of sample m ends between samples m and m + 1, as a fraction of the step.
  double border_after(std::size_t m) const {
    if (!present(m)) return begin_of(m + 1);
    if (!present(m + 1)) return end_of(m);
    const double slope_near = bin_per_ray_[m], slope_far = bin_per_ray_[m + 1];
    const double step = static_cast<double>(bin_[m + 1]) - bin_[m];
    const double parting = slope_near - slope_far;

    // One plane, within tolerance: only the brightness changes.
    const double misfit = step - 0.5 * (slope_near + slope_far);
    if (std::abs(misfit) <= 2.0 * kBinTolerance && std::abs(parting) <= 2.0 * kBinTolerance) {
      return brightness_border(m);
    }
    // Two planes that meet between the rays.
    const double meeting = (step - slope_far) / parting;
    if (meeting >= 0.0 && meeting <= 1.0) return meeting;
    // A surface with relief finer than the ray spacing: not an outline.
    if (std::abs(misfit) <= 0.25 * (std::abs(slope_near) + std::abs(slope_far))) return 0.5;
    // An outline: the nearer face ends, or begins, in front of the farther one.
    return misfit > 0.0 ? end_of(m) : begin_of(m + 1);
  }

  double brightness_border(std::size_t m) const {
    const std::uint32_t here = surface_[m], there = surface_[m + 1];
    const Appearance* appearance = appearance_of(here);
    if (appearance != appearance_of(there)) return end_of(m);
    if (appearance == nullptr || !appearance->checker) return 0.5;
    return appearance->checker->border(scene_point(m), scene_point(m + 1));
  }

  const Appearance* appearance_of(std::uint32_t surface) const {
    if (surface == kGroundSurface) return scene_.ground;
    return &scene_.appearances.appearances[scene_.appearances.of_triangle[surface]];
  }

  glm::dvec3 scene_point(std::size_t m) const {
    const Acquisition& a = scene_.rays.grid.acquisition();
    const double offset_m = (bin_[m] - 0.5 * a.n_range) * a.range_spacing_m;
    const int k = std::clamp(s_.k_of(m), 0, scene_.rays.grid.fan().n_elevation - 1);
    return scene_.rays.scene_point(s_.along_m, offset_m, k);
  }

  double end_of(std::size_t m) const { return outline(m, +1); }
  double begin_of(std::size_t m) const { return 1.0 - outline(m, -1); }

  /// How far, in ray steps, the face of sample m extends beyond the sample towards greater (+1) or
  /// smaller (−1) k.
  double outline(std::size_t m, int towards) const {
    const std::uint32_t surface = surface_[m];
    if (surface == kGroundSurface) return 0.5;
    const auto rays = scene_.sections.rays_of(surface, s_.along_m);
    if (!rays) return 0.5;
    const double k = s_.k_of(m), steps_per_ray = 1.0 / s_.k_step;
    const double reach = (towards > 0 ? rays->second - k : k - rays->first) * steps_per_ray;
    if (!(reach >= 0.0 && reach <= 1.0)) return 0.5;
    // No ray meets most of the faces that are smaller than the ray spacing. A face that is met represents the others,
    // whether they are separate or parts of a larger surface: it covers half a step on either side.
    const bool small = (rays->second - rays->first) * steps_per_ray < 1.0;
    return small ? 0.5 : reach;
  }

  const Slice& s_;
  const SliceScene& scene_;
  std::span<double> bins_;
  const LayerSink& layers_;
  const std::uint32_t* surface_;
  const float *bin_, *bin_per_ray_, *bin_per_slice_, *gamma_;
  std::size_t first_ = 0;
  double before_ = 0.0;
  double gamma_sum_ = 0.0;
};

}  // namespace

void deposit_slice(const Slice& slice, const SliceScene& scene, std::span<double> bins,
                   const LayerSink& layers) {
  Reconstruction(slice, scene, bins, layers).run();
}

namespace {

/// The mesh takes precedence over a ground that lies above it by less than this fraction of a bin plus the
/// single-precision rounding of the scene's coordinates: floors and roads lie in the ground's plane.
constexpr double kCoplanarInBins = 1.0 / 300.0;
constexpr double kSinglePrecision = 0x1p-21;

/// Largest coordinate of a view's rays in the scene frame, in which they are traced (m).
double reach_m(const ViewRays& rays) {
  const Acquisition& a = rays.grid.acquisition();
  const auto at = [&](std::size_t n) {
    return glm::length(glm::dvec3(rays.origin_x[n], rays.origin_y[n], rays.origin_z[n]));
  };
  return std::max(at(0), at(rays.origin_x.size() - 1)) + 0.5 * a.n_azimuth * a.azimuth_spacing_m +
         static_cast<double>(rays.far_m);
}

}  // namespace

GroundPlane::GroundPlane(const ViewRays& rays, const Appearance& appearance, double height_m)
    : rays_(rays), appearance_(appearance) {
  const Acquisition& a = rays.grid.acquisition();
  const Fan& fan = rays.grid.fan();
  const double theta = a.incidence_rad, r = a.slant_range_m;
  const double above_ground_m = a.aim_m.y - height_m;  // of the aim point
  const double height_of_radar_m = a.altitude_m() + above_ground_m;

  const auto size = static_cast<std::size_t>(fan.n_elevation) + 2;
  const double coplanar_m = kCoplanarInBins * a.range_spacing_m + kSinglePrecision * reach_m(rays);
  bin_.assign(size, 0.0f);
  coplanar_bins_.assign(size, 0.0f);
  bin_per_ray_.assign(size, 0.0f);
  gamma_.assign(size, -1.0f);  // negative: this ray does not meet the plane
  for (int k = -1; k <= fan.n_elevation; ++k) {
    const double delta = fan.ray_angle_rad(k);
    const double offset_m = plane_range_offset_m(a, -above_ground_m, delta);
    if (!std::isfinite(offset_m)) continue;
    const double incidence = theta + delta;
    const double cosine = std::cos(incidence);
    const std::size_t m = index(k);
    bin_[m] = static_cast<float>(rays.bin_coordinate(offset_m));
    bin_per_ray_[m] = static_cast<float>((r + offset_m) * std::tan(incidence) * fan.step_rad /
                                         a.range_spacing_m);
    coplanar_bins_[m] = static_cast<float>(coplanar_m / cosine / a.range_spacing_m);
    gamma_[m] = appearance_.brightness(static_cast<float>(cosine));
  }

  if (!uniform()) return;
  const auto angle_at_range = [&](double range_m) {
    return range_m <= height_of_radar_m ? 0.0 : std::acos(height_of_radar_m / range_m);
  };
  const auto gamma_at = [&](double incidence) {
    return static_cast<double>(appearance_.brightness(static_cast<float>(std::cos(incidence))));
  };
  double near_angle = angle_at_range(a.range_m(-0.5));
  border_ray_.push_back((near_angle - theta - fan.first_angle_rad) / fan.step_rad - 0.5);
  for (int j = 0; j < a.n_range; ++j) {
    const double far_angle = angle_at_range(a.range_m(j + 0.5));
    border_ray_.push_back((far_angle - theta - fan.first_angle_rad) / fan.step_rad - 0.5);
    // Simpson's rule over one bin.
    bin_gamma_.push_back((gamma_at(near_angle) + 4.0 * gamma_at(0.5 * (near_angle + far_angle)) +
                          gamma_at(far_angle)) / 6.0);
    near_angle = far_angle;
  }
}

void GroundPlane::put(Slice& slice, std::size_t m, int k) const {
  const std::size_t g = index(k);
  if (gamma_[g] < 0.0f) {
    slice.surface[m] = kNoTriangle;
    slice.gamma[m] = 0.0f;
    return;
  }
  slice.surface[m] = kGroundSurface;
  slice.bin[m] = bin_[g];
  slice.bin_per_ray[m] = bin_per_ray_[g];
  slice.bin_per_slice[m] = 0.0f;
  slice.gamma[m] = gamma_[g];
  if (appearance_.checker) {
    const Acquisition& a = rays_.grid.acquisition();
    const int inside = std::clamp(k, 0, rays_.grid.fan().n_elevation - 1);
    const double offset_m = (bin_[g] - 0.5 * a.n_range) * a.range_spacing_m;
    slice.gamma[m] *= appearance_.checker->factor(glm::vec3(rays_.scene_point(slice.along_m, offset_m, inside)));
  }
}

void GroundPlane::fill(Slice& slice) const {
  const auto last = static_cast<std::size_t>(slice.n_rays) + 1;
  put(slice, 0, slice.first - 1);
  put(slice, last, slice.first + slice.n_rays);
  for (std::size_t m = 1; m < last; ++m) {
    const int k = slice.first + static_cast<int>(m) - 1;
    const std::size_t g = index(k);
    const bool behind_mesh = slice.surface[m] != kNoTriangle &&
                             (gamma_[g] < 0.0f || bin_[g] > slice.bin[m] - coplanar_bins_[g]);
    if (!behind_mesh) put(slice, m, k);
  }
}

void GroundPlane::fill_alone(int first, int n, Slice& slice) const {
  slice.resize(n);
  slice.first = first;
  for (int m = 0; m <= n + 1; ++m) put(slice, static_cast<std::size_t>(m), first + m - 1);
}

void GroundPlane::deposit_outside(double gap_first, double gap_last, double weight,
                                  std::span<double> bins) const {
  const double first = std::min(gap_first, gap_last);
  for (std::size_t j = 0; j < bins.size(); ++j) {
    const double near = border_ray_[j], far = border_ray_[j + 1];
    const double hidden = std::max(0.0, std::min(far, gap_last) - std::max(near, first));
    bins[j] += weight * bin_gamma_[j] * std::max(0.0, far - near - hidden);
  }
}

}  // namespace sarnerf
