// SPDX-License-Identifier: Apache-2.0
#include "sight.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <tuple>

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

std::vector<std::uint8_t> Sight::seen_alone(std::span<const SurfaceSample> samples, std::span<const Acquisition> views,
                                            const Monitor& monitor) const {
  struct Place {
    std::int64_t pixel = -1;  ///< −1: the view does not see the sample
    double elevation_m = 0.0;
    std::size_t sample = 0;
  };
  std::vector<std::uint8_t> alone(samples.size(), 0);
  std::vector<Place> places(samples.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    monitor.check();
    monitor.report("testing what is laid over", v, views.size());
    const View view{views[v], radar_frame(views[v])};
    const Acquisition& a = view.acquisition;
    parallel_for(samples.size(), 1024, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n) {
        places[n] = {-1, 0.0, n};
        if (!sees(view, samples[n])) continue;
        const RadarPoint p = project(a, view.frame, samples[n].point_m);
        const auto row = static_cast<std::int64_t>(std::floor(p.along_track_m / a.azimuth_spacing_m + 0.5 * a.n_azimuth));
        const auto bin = static_cast<std::int64_t>(std::floor(p.range_offset_m / a.range_spacing_m + 0.5 * a.n_range));
        places[n] = {row * a.n_range + bin, p.ray_angle_rad * (a.slant_range_m + p.range_offset_m), n};
      }
    });
    std::sort(places.begin(), places.end(), [](const Place& x, const Place& y) {
      return std::tie(x.pixel, x.elevation_m, x.sample) < std::tie(y.pixel, y.elevation_m, y.sample);
    });
    const double gap_m = std::max(a.range_spacing_m, a.azimuth_spacing_m);
    for (std::size_t first = 0, end; first < places.size(); first = end) {
      bool apart = false;
      for (end = first + 1; end < places.size() && places[end].pixel == places[first].pixel; ++end)
        apart |= places[end].elevation_m - places[end - 1].elevation_m > gap_m;
      if (places[first].pixel < 0 || apart) continue;
      for (std::size_t n = first; n < end; ++n) alone[places[n].sample] = 1;
    }
  }
  return alone;
}

std::vector<std::uint8_t> Sight::reached(std::span<const glm::dvec3> points_m, std::span<const Acquisition> views,
                                         const Monitor& monitor) const {
  return by_any(points_m, views, monitor, "testing where rays reach",
                [&](const View& view, const glm::dvec3& point_m) { return reaches(view, point_m); });
}

namespace {

/// Lines that one line of points stands for, along either axis: points are half a pixel apart where columns are an eighth of that.
constexpr std::uint32_t kStride = 8;

/// Intervals of one line.
std::span<const Columns::Interval> line_of(const Columns& columns, std::uint32_t i, std::uint32_t k) {
  const auto first = columns.intervals.begin() + static_cast<std::ptrdiff_t>(columns.row_begin[k]);
  const auto last = columns.intervals.begin() + static_cast<std::ptrdiff_t>(columns.row_begin[k + 1]);
  const auto [low, high] = std::equal_range(first, last, Columns::Interval{i, 0.0, 0.0},
                                            [](const auto& a, const auto& b) { return a.i < b.i; });
  return {low, high};
}

bool holds(std::span<const Columns::Interval> line, double y_m) {
  return std::any_of(line.begin(), line.end(), [&](const auto& part) { return y_m >= part.bottom_m && y_m < part.top_m; });
}

}  // namespace

HiddenSpace hidden_space(const Columns& extracted, const Columns& truth, const Box& truth_box_m, const Sight& truth_sight,
                         std::span<const Acquisition> views, const Monitor& monitor) {
  const ColumnLattice& lattice = truth.lattice;
  const double step_m = kStride * lattice.spacing_m;
  std::vector<glm::dvec3> points_m;
  std::vector<std::uint8_t> is_extracted;
  for (std::uint32_t k = kStride / 2; k < lattice.n_z; k += kStride) {
    for (std::uint32_t i = kStride / 2; i < lattice.n_x; i += kStride) {
      const glm::dvec3 foot(lattice.x_m + (i + 0.5) * lattice.spacing_m, 0.0, lattice.z_m + (k + 0.5) * lattice.spacing_m);
      const auto mine = line_of(extracted, i, k), its = line_of(truth, i, k);
      const bool in_box = foot.x > truth_box_m.min.x && foot.x < truth_box_m.max.x && foot.z > truth_box_m.min.z && foot.z < truth_box_m.max.z;
      const double top_m = mine.empty() ? truth_box_m.max.y : std::max(truth_box_m.max.y, mine.back().top_m);
      for (double y_m = truth_box_m.min.y + 0.5 * step_m; y_m < top_m; y_m += step_m) {
        const bool filled = holds(mine, y_m);
        if (holds(its, y_m) || !(filled || (in_box && y_m < truth_box_m.max.y))) continue;
        points_m.emplace_back(foot.x, y_m, foot.z);
        is_extracted.push_back(filled ? 1 : 0);
      }
    }
  }
  const std::vector<std::uint8_t> reached = truth_sight.reached(points_m, views, monitor);
  HiddenSpace space;
  const double cell_m3 = step_m * step_m * step_m;
  for (std::size_t n = 0; n < points_m.size(); ++n) {
    if (reached[n] != 0) continue;
    const glm::dvec3& p = points_m[n];
    if (is_extracted[n] != 0) space.extracted_m3 += cell_m3;
    if (glm::all(glm::greaterThan(p, truth_box_m.min)) && glm::all(glm::lessThan(p, truth_box_m.max))) space.whole_m3 += cell_m3;
  }
  return space;
}

}  // namespace sarnerf
