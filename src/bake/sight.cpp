// SPDX-License-Identifier: Apache-2.0
#include "sight.h"

#include <atomic>
#include <cmath>
#include <limits>

#include "sarnerf/core/parallel.h"

namespace sarnerf {

namespace {

/// Additive recurrence in three dimensions: steps 1/g, 1/g², 1/g³ with g⁴ = g + 1, the generalised golden ratio.
constexpr double kRatio = 1.2207440846057596;

double step(std::size_t n, double ratio) {
  const double x = 0.5 + static_cast<double>(n) / ratio;
  return x - std::floor(x);
}

glm::dvec3 area_vector(const SurfaceMesh& mesh, const glm::uvec3& t) {
  const glm::dvec3& a = mesh.vertices_m[t.x];
  return 0.5 * glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a);
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const SurfaceMesh& mesh, std::size_t n) {
  double total_m2 = 0.0;
  for (const glm::uvec3& t : mesh.triangles) total_m2 += glm::length(area_vector(mesh, t));
  std::vector<SurfaceSample> samples;
  if (!(total_m2 > 0.0)) return samples;
  samples.reserve(n);

  double end_m2 = 0.0;  // area up to and including triangle t
  for (std::uint32_t t = 0; t < mesh.triangles.size() && samples.size() < n; ++t) {
    const glm::uvec3& corners = mesh.triangles[t];
    const glm::dvec3 area = area_vector(mesh, corners);
    const double area_m2 = glm::length(area);
    if (!(area_m2 > 0.0)) continue;
    end_m2 += area_m2;
    while (samples.size() < n) {
      // Anywhere in its stratum: equal steps would always select the same ones of equal triangles.
      const std::size_t m = samples.size();
      const double at_m2 = (static_cast<double>(m) + step(m, kRatio)) * (total_m2 / static_cast<double>(n));
      if (at_m2 >= end_m2) break;
      double u = step(m, kRatio * kRatio), v = step(m, kRatio * kRatio * kRatio);
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      const glm::dvec3& a = mesh.vertices_m[corners.x];
      samples.push_back({a + u * (mesh.vertices_m[corners.y] - a) + v * (mesh.vertices_m[corners.z] - a),
                         area / area_m2, t});
    }
  }
  return samples;
}

namespace {

/// In units of half the diagonal: a hundred times the rounding of float32, and 0.1 mm on a house.
constexpr double kLift = 1e-5;

/// Sides of a box along the line of sight have |n·d| of some 1e-16, or 1e-6 from a file of six digits.
constexpr double kLeastFacing = 1e-4;

constexpr float kFar = std::numeric_limits<float>::infinity();

bool in_swath(const Acquisition& a, const RadarPoint& p) {
  const double row = p.along_track_m / a.azimuth_spacing_m, bin = p.range_offset_m / a.range_spacing_m;
  return row >= -0.5 * a.n_azimuth && row < 0.5 * a.n_azimuth && bin >= -0.5 * a.n_range && bin < 0.5 * a.n_range;
}

std::vector<glm::vec3> normalised(const SurfaceMesh& mesh, const glm::dvec3& centre_m, double unit_m) {
  std::vector<glm::vec3> vertices;
  vertices.reserve(mesh.vertices_m.size() + 1);
  for (const glm::dvec3& v : mesh.vertices_m) vertices.emplace_back((v - centre_m) / unit_m);
  vertices.emplace_back(0.0f);
  return vertices;
}

double half_diagonal_m(const Box& box) {
  const double half_m = box.empty() ? 0.0 : 0.5 * glm::length(box.size());
  return half_m > 0.0 ? half_m : 1.0;
}

}  // namespace

Sight::Sight(const SurfaceMesh& mesh, const Box& box_m, std::size_t n_solid)
    : centre_m_(box_m.empty() ? glm::dvec3(0.0) : box_m.centre()),
      unit_m_(half_diagonal_m(box_m)),
      n_solid_(n_solid),
      vertices_(normalised(mesh, centre_m_, unit_m_)),
      tracer_(std::span<const glm::vec3>(vertices_).first(mesh.vertices_m.size()), mesh.triangles) {}

glm::vec3 Sight::lifted(const SurfaceSample& sample, const glm::dvec3& normal) const {
  return glm::vec3((sample.point_m - centre_m_) / unit_m_ + kLift * normal);
}

bool Sight::buried(const SurfaceSample& sample, std::vector<Crossing>& crossings) const {
  tracer_.all_hits(lifted(sample, sample.normal), {0.0f, 1.0f, 0.0f}, kFar, crossings);
  int winding = 0;
  for (const Crossing& crossing : crossings) {
    if (crossing.triangle < n_solid_) winding += (crossing.normal.y > 0.0f) - (crossing.normal.y < 0.0f);
  }
  return winding > 0;
}

bool Sight::sees(const View& view, const SurfaceSample& sample) const {
  const RadarPoint at = project(view.acquisition, view.frame, sample.point_m);
  if (!in_swath(view.acquisition, at)) return false;
  const glm::dvec3 to_radar = -(std::cos(at.ray_angle_rad) * view.frame.k + std::sin(at.ray_angle_rad) * view.frame.v);
  const double facing = glm::dot(sample.normal, to_radar);
  const bool thin = sample.triangle >= n_solid_;
  if ((thin ? std::abs(facing) : facing) <= kLeastFacing) return false;
  const glm::dvec3 lit_side = facing < 0.0 ? -sample.normal : sample.normal;
  const double range = (view.acquisition.slant_range_m + at.range_offset_m) / unit_m_;
  return !tracer_.meets_any(lifted(sample, lit_side), glm::vec3(to_radar), static_cast<float>(range));
}

bool Sight::reaches(const View& view, const glm::dvec3& point_m) const {
  const RadarPoint at = project(view.acquisition, view.frame, point_m);
  if (!in_swath(view.acquisition, at)) return false;
  const glm::dvec3 to_radar = -(std::cos(at.ray_angle_rad) * view.frame.k + std::sin(at.ray_angle_rad) * view.frame.v);
  const double range = (view.acquisition.slant_range_m + at.range_offset_m) / unit_m_;
  return !tracer_.meets_any(glm::vec3((point_m - centre_m_) / unit_m_), glm::vec3(to_radar), static_cast<float>(range));
}

template <class Item, class Test>
std::vector<std::uint8_t> Sight::by_any(std::span<const Item> items, std::span<const Acquisition> views, const Monitor& monitor,
                                        const char* stage, Test&& test) const {
  std::vector<View> all;
  for (const Acquisition& acquisition : views) all.push_back({acquisition, radar_frame(acquisition)});
  std::vector<std::uint8_t> passed(items.size(), 0);
  std::atomic<std::uint64_t> n_done{0};
  parallel_for(items.size(), 1024, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    std::size_t last = 0;
    for (std::size_t n = begin; n < end; ++n) {
      for (std::size_t m = 0; m < all.size() && passed[n] == 0; ++m) {
        const std::size_t view = (last + m) % all.size();
        if (!test(all[view], items[n])) continue;
        passed[n] = 1;
        last = view;
      }
    }
    const std::uint64_t done = n_done += end - begin;
    if (worker == 0) monitor.report(stage, done, items.size());
  });
  return passed;
}

std::vector<std::uint8_t> Sight::seen(std::span<const SurfaceSample> samples, std::span<const Acquisition> views,
                                      const Monitor& monitor) const {
  return by_any(samples, views, monitor, "testing what views see",
                [&](const View& view, const SurfaceSample& sample) { return sees(view, sample); });
}

std::vector<std::uint8_t> Sight::reached(std::span<const glm::dvec3> points_m, std::span<const Acquisition> views,
                                         const Monitor& monitor) const {
  return by_any(points_m, views, monitor, "testing where rays reach",
                [&](const View& view, const glm::dvec3& point_m) { return reaches(view, point_m); });
}

}  // namespace sarnerf
