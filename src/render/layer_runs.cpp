// SPDX-License-Identifier: Apache-2.0
#include "layer_runs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sarnerf {
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

}  // namespace sarnerf
