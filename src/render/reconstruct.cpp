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
/// Samples that are tested together.
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
  /// Does a sample continue the run that begins at `first`?
  struct RunTest {
    float bin, slope, smear, gamma, smear_tolerance, gamma_tolerance;

    RunTest(const Reconstruction& r, std::size_t first)
        : bin(r.bin_[first]),
          slope(r.bin_per_ray_[first]),
          smear(r.bin_per_slice_[first]),
          gamma(r.gamma_[first]),
          smear_tolerance(kBinTolerance * (1.0f + std::abs(smear))),
          gamma_tolerance(kGammaTolerance * gamma) {}

    /// Not zero if sample n, which is `step` after the first, does not.
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
  /// sees every ray.
  std::size_t end_of_run(std::size_t m, std::size_t last) {
    if (!present(m)) return m;
    const RunTest test(*this, first_);
    float gamma_sum = 0.0f;
    // Whole blocks without a branch inside, which the compiler vectorises, then single samples.
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

  /// Ends the run at sample m plus `after` of a ray step, and deposits it.
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

  /// Where, between samples m and m + 1, what m sees ends: a fraction of the step.
  double border_after(std::size_t m) const {
    if (!present(m)) return begin_of(m + 1);
    if (!present(m + 1)) return end_of(m);
    const double slope_near = bin_per_ray_[m], slope_far = bin_per_ray_[m + 1];
    const double step = static_cast<double>(bin_[m + 1]) - bin_[m];
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

  /// How far, in ray steps, the face seen by sample m reaches beyond it towards greater (+1) or
  /// smaller (−1) k.
  double outline(std::size_t m, int towards) const {
    const std::uint32_t surface = surface_[m];
    if (surface == kGroundSurface) return 0.5;
    const auto rays = scene_.sections.rays_of(surface, s_.along_m);
    if (!rays) return 0.5;
    const double k = s_.k_of(m), steps_per_ray = 1.0 / s_.k_step;
    const double reach = (towards > 0 ? rays->second - k : k - rays->first) * steps_per_ray;
    if (!(reach >= 0.0 && reach <= 1.0)) return 0.5;
    // Of faces smaller than the spacing of the rays most are met by no ray. Each one that is stands for those
    // that are not, be they alone or parts of a larger surface: for half a step on either side.
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

}  // namespace sarnerf
