// SPDX-License-Identifier: Apache-2.0
#include "reconstruct.h"

#include <algorithm>
#include <cmath>

#include "deposit.h"

namespace sarnerf {
namespace {

/// Largest departure (bins) of a run from the straight line that is deposited in its place.
constexpr float kBinTolerance = 0.004f;
/// Largest relative change of γ inside a run. Its mean is exact; this only bounds its distribution.
constexpr float kGammaTolerance = 0.001f;

class Reconstruction {
 public:
  Reconstruction(const Slice& slice, const SliceScene& scene, std::span<double> bins)
      : s_(slice), scene_(scene), bins_(bins) {}

  void run() {
    const auto last = static_cast<std::size_t>(s_.n_rays) + 1;
    // The run that touches the first end sample begins at that sample itself, not half a ray before.
    open(0, 0.0);
    for (std::size_t m = 0; m < last; ++m) {
      if (continues(m)) {
        gamma_sum_ += s_.gamma[m + 1];
        continue;
      }
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
  bool present(std::size_t m) const { return s_.surface[m] != kNoTriangle; }

  void open(std::size_t m, double before) {
    first_ = m;
    before_ = before;
    gamma_sum_ = present(m) ? s_.gamma[m] : 0.0f;
  }

  /// Whether sample m + 1 prolongs the run on the same plane with the same brightness.
  bool continues(std::size_t m) const {
    if (!present(m) || !present(m + 1)) return false;
    const std::size_t n = m + 1;
    const float slope = s_.bin_per_ray[first_];
    const float straight = s_.bin[first_] + slope * static_cast<float>(n - first_);
    const float gamma = s_.gamma[first_];
    const bool plane = std::abs(s_.bin[n] - straight) <= kBinTolerance &&
                       std::abs(s_.bin_per_ray[n] - slope) <= kBinTolerance &&
                       std::abs(s_.bin_per_slice[n] - s_.bin_per_slice[first_]) <=
                           kBinTolerance * (1.0f + std::abs(s_.bin_per_slice[first_]));
    return plane && std::abs(s_.gamma[n] - gamma) <= kGammaTolerance * gamma;
  }

  /// Ends the run at sample m plus `after` of a ray step, and deposits it.
  void close(std::size_t m, double after) const {
    if (!present(m)) return;
    const double gamma_first = s_.gamma[first_], gamma_last = s_.gamma[m];
    const double mass = m == first_ ? gamma_first * (before_ + after)
                                    : gamma_sum_ + (before_ - 0.5) * gamma_first +
                                          (after - 0.5) * gamma_last;
    if (!(mass > 0.0)) return;
    const double x_first = s_.bin[first_] - before_ * s_.bin_per_ray[first_];
    const double x_last = s_.bin[m] + after * s_.bin_per_ray[m];
    const double smear = 0.5 * (s_.bin_per_slice[first_] + s_.bin_per_slice[m]);
    deposit_trapezoid(bins_, x_first, x_last, smear, mass);
  }

  /// Where, between samples m and m + 1, what m sees ends: a fraction of the step.
  double border_after(std::size_t m) const {
    if (!present(m)) return begin_of(m + 1);
    if (!present(m + 1)) return end_of(m);
    const double slope_near = s_.bin_per_ray[m], slope_far = s_.bin_per_ray[m + 1];
    const double step = static_cast<double>(s_.bin[m + 1]) - s_.bin[m];
    const double parting = slope_near - slope_far;

    // One plane, up to tolerance: only the brightness changes here.
    const double misfit = step - 0.5 * (slope_near + slope_far);
    if (std::abs(misfit) <= 2.0 * kBinTolerance && std::abs(parting) <= 2.0 * kBinTolerance) {
      return brightness_border(m);
    }
    // Two planes that meet between the rays.
    const double meeting = (step - slope_far) / parting;
    if (meeting >= 0.0 && meeting <= 1.0) return meeting;
    // A rough surface, finer than the rays: no reason to see an outline in it.
    if (std::abs(misfit) <= 0.25 * (std::abs(slope_near) + std::abs(slope_far))) return 0.5;
    // An outline: the nearer face ends, or begins, in front of the farther one.
    return misfit > 0.0 ? end_of(m) : begin_of(m + 1);
  }

  double brightness_border(std::size_t m) const {
    const std::uint32_t here = s_.surface[m], there = s_.surface[m + 1];
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
    const double offset_m = (s_.bin[m] - 0.5 * a.n_range) * a.range_spacing_m;
    const int k = std::clamp(s_.first + static_cast<int>(m) - 1, 0,
                             scene_.rays.grid.fan().n_elevation - 1);
    return scene_.rays.scene_point(s_.along_m, offset_m, k);
  }

  double end_of(std::size_t m) const { return outline(m, +1); }
  double begin_of(std::size_t m) const { return 1.0 - outline(m, -1); }

  /// How far, in ray steps, the face seen by sample m reaches beyond it towards greater (+1) or
  /// smaller (−1) k.
  double outline(std::size_t m, int towards) const {
    const std::uint32_t surface = s_.surface[m];
    if (surface == kGroundSurface) return 0.5;
    const auto rays = scene_.sections.rays_of(surface, s_.along_m);
    if (!rays) return 0.5;
    const double k = s_.first + static_cast<double>(m) - 1.0;
    const double reach = towards > 0 ? rays->second - k : k - rays->first;
    if (!(reach >= 0.0 && reach <= 1.0)) return 0.5;
    // Faces smaller than the spacing of the rays have neighbours that no ray met: the outline is
    // somewhere between this face's end and the next ray.
    const bool small = rays->second - rays->first < 1.0;
    return small ? 0.5 * (reach + 1.0) : reach;
  }

  const Slice& s_;
  const SliceScene& scene_;
  std::span<double> bins_;
  std::size_t first_ = 0;
  double before_ = 0.0;
  double gamma_sum_ = 0.0;
};

}  // namespace

void deposit_slice(const Slice& slice, const SliceScene& scene, std::span<double> bins) {
  Reconstruction(slice, scene, bins).run();
}

}  // namespace sarnerf
