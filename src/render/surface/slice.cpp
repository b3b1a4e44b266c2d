// SPDX-License-Identifier: Apache-2.0
#include "surface/slice.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/parallel.h"

namespace sarnerf {

namespace {

/// Neighbouring rays whose hits have the same appearance. Raw pointers, so that the compiler
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

namespace {

/// Inputs and outputs of the loop below. Raw pointers, so that the compiler vectorises it.
struct PlaneLoop {
  std::size_t n;
  const float *direction_x, *direction_y, *direction_z, *turn_x, *turn_y, *turn_z;
  const float *distance, *normal_x, *normal_y, *normal_z;
  float h_x, h_y, h_z;
  float start_bin;         // x of the ray origins
  float bins_per_m;
  float start_range_m;     // slant range of the ray origins
  float step_rad;          // Δθ
  float width_m;
  float *bin, *bin_per_ray, *bin_per_slice, *cosine;
};

/// On a plane with normal n, range t changes with the ray angle δ by −t (n·∂d/∂δ)/(n·d) and with the
/// along-track coordinate a by −(n·h)/(n·d).
SARNERF_CLONES void evaluate_planes(const PlaneLoop& p) {
#pragma GCC ivdep
  for (std::size_t k = 0; k < p.n; ++k) {
    const float nx = p.normal_x[k], ny = p.normal_y[k], nz = p.normal_z[k];
    const float along_d =
        nx * p.direction_x[k] + ny * p.direction_y[k] + nz * p.direction_z[k];
    const float along_turn = nx * p.turn_x[k] + ny * p.turn_y[k] + nz * p.turn_z[k];
    const float along_h = nx * p.h_x + ny * p.h_y + nz * p.h_z;
    const float length = std::sqrt(nx * nx + ny * ny + nz * nz);
    // A face seen edge-on has an infinite slope; limiting it does no harm, since its projected area is zero.
    const float steepest = std::copysign(std::max(std::abs(along_d), 1e-6f * length), along_d);
    const float inverse = p.bins_per_m / steepest;
    p.bin[k] = p.start_bin + p.distance[k] * p.bins_per_m;
    p.bin_per_ray[k] = -(p.start_range_m + p.distance[k]) * p.step_rad * along_turn * inverse;
    p.bin_per_slice[k] = -p.width_m * along_h * inverse;
    p.cosine[k] = -along_d / length;
  }
}

SARNERF_CLONES void shift_origins(std::size_t n, const double* from, double shift, float* to) {
  for (std::size_t k = 0; k < n; ++k) to[k] = static_cast<float>(from[k] + shift);
}

PlaneLoop plane_loop(const ViewRays& rays, std::size_t from, std::size_t count,
                     const SliceBlock::Rays& scratch) {
  const Acquisition& acquisition = rays.grid.acquisition();
  const glm::vec3 h(rays.grid.frame().h);
  PlaneLoop loop{};
  loop.n = count;
  loop.direction_x = rays.direction_x.data() + from;
  loop.direction_y = rays.direction_y.data() + from;
  loop.direction_z = rays.direction_z.data() + from;
  loop.turn_x = rays.turn_x.data() + from;
  loop.turn_y = rays.turn_y.data() + from;
  loop.turn_z = rays.turn_z.data() + from;
  loop.distance = scratch.distance.data();
  loop.normal_x = scratch.normal_x.data();
  loop.normal_y = scratch.normal_y.data();
  loop.normal_z = scratch.normal_z.data();
  loop.h_x = h.x;
  loop.h_y = h.y;
  loop.h_z = h.z;
  loop.start_bin = static_cast<float>(rays.bin_coordinate(rays.start_offset_m));
  loop.bins_per_m = static_cast<float>(1.0 / acquisition.range_spacing_m);
  loop.start_range_m = static_cast<float>(acquisition.slant_range_m + rays.start_offset_m);
  loop.step_rad = static_cast<float>(rays.grid.fan().step_rad);
  return loop;
}

/// Resizes scratch whose content is not needed: frees the old memory before it allocates, without spare capacity.
template <class T>
void regrow(std::vector<T>& array, std::size_t size) {
  array = std::vector<T>();
  array.resize(size);
}

}  // namespace

void Slice::resize(int n) {
  n_rays = n;
  const auto size = static_cast<std::size_t>(n) + 2;
  if (surface.size() >= size) return;
  regrow(surface, size);
  for (auto* array : {&bin, &bin_per_ray, &bin_per_slice, &gamma, &cosine}) regrow(*array, size);
}

void Slice::scale(double weight) {
  if (weight == 1.0) return;
  for (std::size_t m = 0; m < static_cast<std::size_t>(n_rays) + 2; ++m) gamma[m] *= static_cast<float>(weight);
}

void SliceBlock::Rays::resize(int n) {
  const auto size = static_cast<std::size_t>(n);
  if (distance.size() >= size) return;
  for (auto* array :
       {&origin_x, &origin_y, &origin_z, &distance, &normal_x, &normal_y, &normal_z}) {
    regrow(*array, size);
  }
}

std::uint64_t trace_slices(const RayTracer& tracer, const ViewRays& rays,
                           const AppearanceTable& table, int first, int n, SliceBlock& block) {
  const auto from = static_cast<std::size_t>(first);
  const auto count = static_cast<std::size_t>(n);
  const auto part = [&](const std::vector<float>& all) { return std::span(all).subspan(from, count); };
  const auto head = [&](auto& all) { return std::span(all).first(count); };

  std::array<RayRow, RayTracer::kRowsPerBlock> rows;
  std::array<HitRow, RayTracer::kRowsPerBlock> hits;
  for (std::size_t s = 0; s < block.n_slices; ++s) {
    Slice& slice = block.slices[s];
    SliceBlock::Rays& r = block.rays[s];
    slice.first = first;
    slice.resize(n);
    r.resize(n);
    const glm::dvec3 shift = slice.along_m * rays.grid.frame().h;
    shift_origins(count, rays.origin_x.data() + from, shift.x, r.origin_x.data());
    shift_origins(count, rays.origin_y.data() + from, shift.y, r.origin_y.data());
    shift_origins(count, rays.origin_z.data() + from, shift.z, r.origin_z.data());
    rows[s] = {head(std::as_const(r.origin_x)), head(std::as_const(r.origin_y)),
               head(std::as_const(r.origin_z)), part(rays.direction_x),
               part(rays.direction_y),          part(rays.direction_z),
               rays.far_m};
    hits[s] = {head(r.distance), head(r.normal_x), head(r.normal_y), head(r.normal_z),
               std::span(slice.surface).subspan(1, count)};
  }
  tracer.first_hits(std::span(rows).first(block.n_slices), std::span(hits).first(block.n_slices));

  std::uint64_t n_hits = 0;
  for (std::size_t s = 0; s < block.n_slices; ++s) {
    Slice& slice = block.slices[s];
    PlaneLoop loop = plane_loop(rays, from, count, block.rays[s]);
    loop.width_m = static_cast<float>(slice.width_m);
    loop.bin = slice.bin.data() + 1;
    loop.bin_per_ray = slice.bin_per_ray.data() + 1;
    loop.bin_per_slice = slice.bin_per_slice.data() + 1;
    loop.cosine = slice.cosine.data() + 1;
    evaluate_planes(loop);
    n_hits += shade(rays, table, block.rays[s], slice);
  }
  return n_hits;
}

}  // namespace sarnerf
