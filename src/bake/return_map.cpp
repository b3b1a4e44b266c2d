// SPDX-License-Identifier: Apache-2.0
#include "return_map.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>

#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

namespace {

/// A ray hits something if it returns this fraction of the median ray that returns anything.
constexpr double kReturnThatMeets = 0.25;

/// Rays that return less than this fraction of the 99th percentile count as returning nothing.
constexpr double kNothing = 0.01;

/// With one more ray at either end, so that every point of the box lies between rays.
Fan fan_over(const Acquisition& view, const Box& box_m, double spacing_m) {
  const auto extent = angular_extent(view, box_m);
  const double step = spacing_m / view.slant_range_m;
  const int n = static_cast<int>((extent.second - extent.first) / step) + 3;
  return {extent.first - step, step, n};
}

float median_of_returning(std::vector<float> returned) {
  if (returned.empty()) return 0.0f;
  const float bright = value_of_rank(returned, returned.size() * 99 / 100);
  const auto least = static_cast<float>(kNothing * double{bright});
  std::erase_if(returned, [&](float r) { return !(r > least); });
  return median(returned);
}

/// Arc tangent, to 1e-12: by a series for |x| up to 0.02, as in most fans.
double small_atan(double x) {
  if (std::abs(x) > 0.02) return std::atan(x);
  const double x2 = x * x;
  return x * (1.0 - x2 * (1.0 / 3.0 - x2 * (1.0 / 5.0 - x2 * (1.0 / 7.0))));
}

}  // namespace

ReturnMap::ReturnMap(const Acquisition& view, const Box& box_m, double spacing_m)
    : view_(view), frame_(radar_frame(view)), rays_(view, fan_over(view, box_m, spacing_m)), spacing_m_(spacing_m) {
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const glm::dvec3& corner : box_m.corners()) {
    low_m = std::min(low_m, glm::dot(corner, frame_.h));
    high_m = std::max(high_m, glm::dot(corner, frame_.h));
  }
  first_along_track_m_ = low_m - spacing_m;
  n_along_ = static_cast<int>((high_m - low_m) / spacing_m) + 4;
  n_angles_ = rays_.fan().n_elevation;
  rays_per_m_ = 1.0 / spacing_m;
  first_angle_rad_ = rays_.fan().ray_angle_rad(0);
  rays_per_rad_ = 1.0 / rays_.fan().step_rad;
  half_swath_m_ = 0.5 * view.n_azimuth * view.azimuth_spacing_m;
  half_depth_m_ = 0.5 * view.n_range * view.range_spacing_m;
}

void ReturnMap::look(const LearnedVolume& volume, const Occupancy& occupancy, const Box& box_m) {
  map_.assign(static_cast<std::size_t>(n_along_) * static_cast<std::size_t>(n_angles_), {});
  VolumeMarcher marcher(volume.grid.view(), volume.channels, occupancy, 0.75 * spacing_m_);
  SampleBatch batch;
  BatchField field;
  std::vector<MarchRay> rays;
  for (int i = 0; i < n_along_; ++i) {
    const double along_track_m = first_along_track_m_ + i * spacing_m_;
    rays.clear();
    for (int k = 0; k < n_angles_; ++k) {
      const RangeInterval inside = clip_to_box(rays_, along_track_m, k, box_m);
      if (!inside.empty()) rays.push_back({along_track_m, 0, k, inside});
    }
    batch.clear();
    field.clear();
    marcher.march(rays_, rays, batch, field);
    for (std::size_t q = 0; q < rays.size(); ++q) {
      const std::size_t begin = batch.ray_begin[q], end = batch.ray_begin[q + 1];
      double transmitted = 1.0, returned = 0.0;
      const auto pass = [&](std::size_t s) {
        const double x = 2.0 * double{field.extinction_per_m[s]} * double{batch.length_m[s]};
        returned -= double{std::max(0.0f, field.source[s])} * transmitted * std::expm1(-x);
        transmitted *= std::exp(-x);
      };
      for (std::size_t s = begin; s < end; ++s) pass(s);
      Ray& ray = map_[static_cast<std::size_t>(i * n_angles_ + rays[q].k)];
      ray.returned = static_cast<float>(returned);
      ray.meets = static_cast<float>(1.0 - transmitted);
      if (!(returned > 0.0)) {
        ray.meets = 0.0f;
        continue;
      }
      const double half = 0.5 * returned;
      transmitted = 1.0, returned = 0.0;
      for (std::size_t s = begin; s < end; ++s) {
        const double before = returned;
        pass(s);
        if (returned < half) continue;
        const double part = (half - before) / (returned - before);
        ray.range_offset_m = static_cast<float>((field.near_bin[s] - 0.5 * view_.n_range) * view_.range_spacing_m +
                                                part * double{batch.length_m[s]});
        break;
      }
    }
  }
}

ReturnMap::Place ReturnMap::place_of(const glm::dvec3& point_m) const {
  // As project(), without its library calls: this is called tens of millions of times.
  const double along_track_m = glm::dot(point_m, frame_.h);
  const double along_k = glm::dot(point_m, frame_.k), along_v = glm::dot(point_m, frame_.v);
  const double r = view_.slant_range_m, depth = r + along_k;
  const double range = std::sqrt(depth * depth + along_v * along_v);
  Place place;
  place.range_offset_m = (along_k * (2.0 * r + along_k) + along_v * along_v) / (range + r);
  place.in_image = std::abs(along_track_m) <= half_swath_m_ && std::abs(place.range_offset_m) <= half_depth_m_;
  const double i = (along_track_m - first_along_track_m_) * rays_per_m_;
  const double k = (small_atan(along_v / depth) - first_angle_rad_) * rays_per_rad_;
  place.among_rays = i >= 0.0 && k >= 0.0 && i < n_along_ - 1 && k < n_angles_ - 1;
  if (!place.among_rays) return place;
  place.i = static_cast<int>(i), place.k = static_cast<int>(k);
  place.u = i - place.i, place.v = k - place.k;
  return place;
}

double ReturnMap::distance_m(const glm::dvec3& point_m) const {
  const Place at = place_of(point_m);
  if (!at.in_image) return std::numeric_limits<double>::quiet_NaN();
  constexpr double kNothingMet = std::numeric_limits<double>::infinity();
  if (!at.among_rays) return kNothingMet;
  double meets = 0.0, met_at_m = 0.0, weight = 0.0;
  for (int n = 0; n < 4; ++n) {
    const Ray& ray = this->ray(at.i + (n >> 1), at.k + (n & 1));
    const double w = ((n >> 1) != 0 ? at.u : 1.0 - at.u) * ((n & 1) != 0 ? at.v : 1.0 - at.v);
    meets += w * double{ray.meets};
    if (ray.meets < 0.5f) continue;
    met_at_m += w * double{ray.range_offset_m};
    weight += w;
  }
  return meets < 0.5 || weight == 0.0 ? kNothingMet : met_at_m / weight - at.range_offset_m;
}

bool ReturnMap::meets_near(const glm::dvec3& point_m, double near_m) const {
  const Place at = place_of(point_m);
  if (!at.in_image || !at.among_rays) return false;
  for (int n = 0; n < 4; ++n) {
    const Ray& ray = this->ray(at.i + (n >> 1), at.k + (n & 1));
    if (ray.meets >= 0.5f && std::abs(double{ray.range_offset_m} - at.range_offset_m) < near_m) return true;
  }
  return false;
}

void ReturnMap::append_returns(std::vector<Return>& returns) const {
  for (int i = 0; i < n_along_; ++i) {
    for (int k = 0; k < n_angles_; ++k) {
      const Ray& ray = map_[static_cast<std::size_t>(i * n_angles_ + k)];
      if (ray.returned <= 0.0f) continue;
      const double along_track_m = first_along_track_m_ + i * spacing_m_, range_offset_m{ray.range_offset_m};
      const glm::dvec3 at_m = rays_.point_from_aim_m(along_track_m, range_offset_m, k);
      returns.push_back({at_m, rays_.point_from_aim_m(along_track_m, range_offset_m + 1.0, k) - at_m, ray.returned});
    }
  }
}

std::vector<ReturnMap> return_maps(const LearnedVolume& volume, const Occupancy& occupancy,
                                   std::span<const Acquisition> views, double spacing_m, const Monitor& monitor) {
  const Box box_m = occupied_box(occupancy, volume.grid.transform());
  std::vector<ReturnMap> maps;
  if (box_m.empty()) return maps;
  for (const Acquisition& view : views) maps.emplace_back(view, box_m, spacing_m);
  std::atomic<std::size_t> n_done = 0;
  parallel_for(maps.size(), 1, [&](std::size_t begin, std::size_t end, int worker) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      maps[n].look(volume, occupancy, box_m);
      const std::size_t done = ++n_done;
      if (worker == 0) monitor.report("tracing return maps", done, maps.size());
    }
  });
  std::vector<float> returned;
  for (const ReturnMap& map : maps)
    for (const ReturnMap::Ray& ray : map.map_)
      if (ray.returned > 0.0f) returned.push_back(ray.returned);
  const float usual = median_of_returning(std::move(returned));
  if (usual > 0.0f) {
    const auto scale = static_cast<float>(0.5 / (kReturnThatMeets * double{usual}));
    for (ReturnMap& map : maps)
      for (ReturnMap::Ray& ray : map.map_) ray.meets = std::max(ray.meets, std::min(1.0f, scale * ray.returned));
  }
  return maps;
}

std::vector<Acquisition> spread_views(std::span<const Acquisition> views, std::size_t n) {
  std::vector<Acquisition> some;
  const std::size_t wanted = std::min(n, views.size());
  for (std::size_t v = 0; v < wanted; ++v) some.push_back(views[v * views.size() / wanted]);
  return some;
}

namespace {

constexpr double kLenient = 0.1, kStrict = 0.4;

/// Fraction of the returned power that comes from empty space: at most so much to keep `kLenient`, and to use `kStrict`.
/// On eight scenes of 396 and 36 views, those that gain by `kStrict` have 0.10 to 0.21 and 0.04 to 0.07; solids and an
/// L-shaped building 0.04 to 0.12 and 0.03 to 0.08; trucks, thin in many parts, 0.18 to 0.25 and 0.10 to 0.15.
constexpr double kMostLenient = 0.1, kMostStrict = 0.07;

/// Distance behind a return at which the body is tested, in learned voxels.
constexpr double kBehind = 2.5;

constexpr std::size_t kRays = 20000;

/// Rises with depth from 0 to 1 over two voxels; ½ on the surface.
float ramp(double depth_m, double voxel_m) {
  return static_cast<float>(std::clamp(0.5 + 0.5 * depth_m / voxel_m, 0.0, 1.0));
}

double out_of_nothing(std::span<const ReturnMap> maps, std::span<const ReturnMap::Return> returns, double share,
                      double voxel_m) {
  std::vector<double> lost(returns.size(), 0.0);
  parallel_for(returns.size(), 256, [&](std::size_t begin, std::size_t end, int) {
    ViewAgreement views(maps, share, voxel_m);
    for (std::size_t r = begin; r < end; ++r) {
      const ReturnMap::Return& from = returns[r];
      if (views.occupancy(from.point_m + kBehind * voxel_m * from.direction) < 0.5f) lost[r] = double{from.power};
    }
  });
  double nothing = 0.0, all = 0.0;
  for (std::size_t r = 0; r < returns.size(); ++r) nothing += lost[r], all += double{returns[r].power};
  return all > 0.0 ? nothing / all : 0.0;
}

}  // namespace

float ViewAgreement::occupancy(const glm::dvec3& point_m) {
  distances_.clear();
  const auto share_of = [&](std::size_t n) {
    return static_cast<std::size_t>(std::ceil(agreeing_share_ * static_cast<double>(n)));
  };
  std::size_t n_in_front = 0;
  const std::size_t most = share_of(maps_.size());
  // Neighbours are mostly empty in the same views: begin with those that showed the last empty point.
  for (std::size_t m = 0; m < maps_.size(); ++m) {
    const double d = maps_[(m + first_) % maps_.size()].distance_m(point_m);
    if (std::isnan(d)) continue;
    distances_.push_back(d);
    if (d < voxel_m_) continue;
    if (n_in_front == 0) begin_ = (m + first_) % maps_.size();
    if (++n_in_front >= most) {
      first_ = begin_;
      return 0.0f;
    }
  }
  if (distances_.empty()) return 0.0f;
  return ramp(-value_of_rank(distances_, share_of(distances_.size()) - 1, std::greater<>()), voxel_m_);
}

double agreeing_share(std::span<const ReturnMap> maps, double learned_voxel_m, std::optional<double> floor_m) {
  std::vector<ReturnMap::Return> all, some;
  for (const ReturnMap& map : maps) map.append_returns(all);
  if (floor_m) std::erase_if(all, [&](const auto& r) { return r.point_m.y < *floor_m + learned_voxel_m; });
  const std::size_t step = all.size() / kRays + 1;
  for (std::size_t r = 0; r < all.size(); r += step) some.push_back(all[r]);
  if (out_of_nothing(maps, some, kLenient, learned_voxel_m) <= kMostLenient) return kLenient;
  return out_of_nothing(maps, some, kStrict, learned_voxel_m) <= kMostStrict ? kStrict : kLenient;
}

}  // namespace sarnerf
