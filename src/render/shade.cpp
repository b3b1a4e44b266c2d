// SPDX-License-Identifier: Apache-2.0
#include "shade.h"

#include <algorithm>

#include "sarnerf/core/clones.h"

namespace sarnerf {
namespace {

/// Neighbouring rays whose hits share their appearance, as bare pointers so that the compiler
/// vectorises the loops below.
struct Run {
  std::size_t n;
  const float *cosine, *distance;
  const float *origin_x, *origin_y, *origin_z, *direction_x, *direction_y, *direction_z;
  float* gamma;
};

SARNERF_CLONES void shade_plain(const Appearance& appearance, const Run& run) {
  const float gamma0 = appearance.gamma0;
  const bool squared = appearance.exponent == 2.0f, two_sided = appearance.two_sided;
  for (std::size_t k = 0; k < run.n; ++k) {
    const float c = facing(run.cosine[k], two_sided);
    run.gamma[k] = gamma0 * (squared ? c * c : c);
  }
}

SARNERF_CLONES void apply_checker(const PlacedChecker& checker, const Run& run) {
  for (std::size_t k = 0; k < run.n; ++k) {
    const float t = run.distance[k];
    run.gamma[k] *= checker.factor({run.origin_x[k] + t * run.direction_x[k],
                                    run.origin_y[k] + t * run.direction_y[k],
                                    run.origin_z[k] + t * run.direction_z[k]});
  }
}

void shade_run(const Appearance& appearance, const Run& run) {
  if (appearance.exponent == 1.0f || appearance.exponent == 2.0f) {
    shade_plain(appearance, run);
  } else {
    for (std::size_t k = 0; k < run.n; ++k) run.gamma[k] = appearance.brightness(run.cosine[k]);
  }
  if (appearance.checker) apply_checker(*appearance.checker, run);
}

}  // namespace

std::uint64_t shade(const ViewRays& rays, const AppearanceTable& table,
                    const SliceBlock::Rays& scratch, Slice& slice) {
  const auto from = static_cast<std::size_t>(slice.first);
  const auto n = static_cast<std::size_t>(slice.n_rays);
  const std::uint32_t* const surface = slice.surface.data() + 1;
  float* const gamma = slice.gamma.data() + 1;
  std::uint64_t n_hits = 0;
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin + 1;
    if (surface[begin] == kNoTriangle) {
      while (end < n && surface[end] == kNoTriangle) ++end;
      std::fill(gamma + begin, gamma + end, 0.0f);
    } else {
      const std::uint16_t appearance = table.of_triangle[surface[begin]];
      const auto shared = [&](std::size_t k) {
        return surface[k] == surface[k - 1] ||
               (surface[k] != kNoTriangle && table.of_triangle[surface[k]] == appearance);
      };
      while (end < n && shared(end)) ++end;
      const std::size_t k = from + begin;
      shade_run(table.appearances[appearance],
                {end - begin, slice.cosine.data() + 1 + begin, scratch.distance.data() + begin,
                 scratch.origin_x.data() + begin, scratch.origin_y.data() + begin,
                 scratch.origin_z.data() + begin, rays.direction_x.data() + k,
                 rays.direction_y.data() + k, rays.direction_z.data() + k, gamma + begin});
      n_hits += end - begin;
    }
    begin = end;
  }
  return n_hits;
}

}  // namespace sarnerf
