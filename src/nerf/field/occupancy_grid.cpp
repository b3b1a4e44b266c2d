// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/occupancy_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {

namespace {

/// Pixels up to this fraction of the peak count as 0: space is carved although an image's zeros were rounded to a small
/// number.
constexpr double kZero = 1e-6;

/// A view's evidence of empty space.
struct EvidenceView {
  Acquisition acquisition;
  RadarFrame frame;
  std::vector<double> first_offset_m;  ///< [n_azimuth] range offset of the first return of a row and its two neighbours
};

std::vector<double> first_returns(const PosedImage& image, double zero_level) {
  const Acquisition& a = image.acquisition;
  const int n_rows = a.n_azimuth;
  std::vector<double> own(static_cast<std::size_t>(n_rows));
  for (int i = 0; i < n_rows; ++i) {
    int j = 0;
    while (j < a.n_range && double{image.power(i, j)} <= zero_level) ++j;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    // A row without any return is empty at all ranges.
    own[static_cast<std::size_t>(i)] = j == 0           ? -kInfinity
                                       : j == a.n_range ? kInfinity
                                                        : a.bin_offset_m(j - 0.5);
  }
  std::vector<double> first = own;
  for (int i = 0; i < n_rows; ++i)
    for (int n = std::max(0, i - 1); n <= std::min(n_rows - 1, i + 1); ++n)
      first[static_cast<std::size_t>(i)] = std::min(first[static_cast<std::size_t>(i)], own[static_cast<std::size_t>(n)]);
  return first;
}

std::vector<EvidenceView> evidence_views(const TrainingSet& set) {
  std::vector<EvidenceView> views;
  for (const PosedImage& image : set.training_images())
    views.push_back({image.acquisition, radar_frame(image.acquisition), first_returns(image, kZero * double{set.peak})});
  return views;
}

enum class Evidence { none, maybe, empty };

/// One view's evidence about a point: `none` if it lies outside of the swath.
Evidence evidence(const EvidenceView& view, const glm::dvec3& point_m, double margin_m) {
  const RadarPoint p = project(view.acquisition, view.frame, point_m);
  const Acquisition& a = view.acquisition;
  const auto i = static_cast<int>(std::lround(a.row_of(p.along_track_m)));
  if (i < 0 || i >= a.n_azimuth) return Evidence::none;
  if (p.range_offset_m < a.bin_offset_m(-0.5) || p.range_offset_m > a.bin_offset_m(a.n_range - 0.5))
    return Evidence::none;
  return p.range_offset_m + margin_m < view.first_offset_m[static_cast<std::size_t>(i)] ? Evidence::empty : Evidence::maybe;
}

/// Whether at least one of the views sees the point, and none shows it to be empty.
bool may_hold_matter(std::span<const EvidenceView* const> views, const glm::dvec3& point_m, double margin_m) {
  bool seen = false;
  for (const EvidenceView* view : views) {
    const Evidence e = evidence(*view, point_m, margin_m);
    if (e == Evidence::empty) return false;
    seen |= e == Evidence::maybe;
  }
  return seen;
}

/// The views whose swath meets a ball; none where one of them shows all of it to be empty. No evidence about a point in the ball
/// depends on the other views.
std::vector<const EvidenceView*> views_of_ball(std::span<const EvidenceView> views, const glm::dvec3& centre_m, double radius_m,
                                               double margin_m) {
  std::vector<const EvidenceView*> some;
  for (const EvidenceView& view : views) {
    const Acquisition& a = view.acquisition;
    const double along_m = glm::dot(centre_m - a.aim_m, view.frame.h);
    const double first_row = a.row_of(along_m - radius_m) - 0.5, last_row = a.row_of(along_m + radius_m) + 0.5;
    if (last_row < 0.0 || first_row > a.n_azimuth - 1) continue;
    const double offset_m = project(a, view.frame, centre_m).range_offset_m;
    if (offset_m + radius_m < a.bin_offset_m(-0.5) || offset_m - radius_m > a.bin_offset_m(a.n_range - 0.5)) continue;
    some.push_back(&view);
    const bool inside = first_row >= 0.0 && last_row <= a.n_azimuth - 1 && offset_m - radius_m >= a.bin_offset_m(-0.5);
    if (!inside) continue;
    double first_m = std::numeric_limits<double>::infinity();
    for (int i = static_cast<int>(first_row); i <= static_cast<int>(last_row); ++i)
      first_m = std::min(first_m, view.first_offset_m[static_cast<std::size_t>(i)]);
    if (offset_m + radius_m + margin_m < std::min(first_m, a.bin_offset_m(a.n_range - 0.5))) return {};
  }
  return some;
}

/// Whether the views of a level ground allow a point to be occupied. Chips of one object all show the whole of it.
bool ground_allows_matter(const TrainingSet& set, std::span<const RadarFrame> frames, const glm::dvec3& point_m) {
  const BareViews views = bare_views(*set.ground, set.images, frames, point_m);
  if (set.ground_rule.object_reach_pixels > 0 && views.n_seeing < set.images.size()) return false;
  const auto n_seeing = static_cast<double>(views.n_seeing);
  return n_seeing > 0.0 && static_cast<double>(views.n_bare) < set.ground_rule.bare_fraction * n_seeing;
}

}  // namespace

void CarvedVoxels::add(const glm::ivec3& voxel) {
  const std::uint32_t brick = topology.insert(brick_of_voxel(voxel));
  active.resize(topology.n_bricks() * kBrickVoxels, 0);
  active[std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(voxel))] = 1;
}

GridTransform grid_transform(const TrainingSet& set, double voxel_size_m) {
  const glm::dvec3 size = set.box_m.size();
  const glm::dvec3 n = glm::ceil(size / voxel_size_m);
  GridTransform transform;
  transform.voxel_size_m = voxel_size_m;
  transform.origin_m = set.box_m.centre() - 0.5 * voxel_size_m * n;
  // The box's bottom lies halfway between two voxel centres: the first centre above it is half a voxel higher.
  transform.origin_m.y = set.box_m.min.y - 0.5 * voxel_size_m;
  return transform;
}

CarvedVoxels carve(const TrainingSet& set, const GridTransform& transform, const Monitor& monitor) {
  const std::vector<EvidenceView> views = evidence_views(set);
  std::vector<RadarFrame> frames;
  for (const EvidenceView& view : views) frames.push_back(view.frame);
  const double margin_m = transform.voxel_size_m;
  const glm::ivec3 last = glm::ivec3(glm::ceil(transform.index_from_world(set.box_m.max)));
  const glm::ivec3 first = glm::ivec3(glm::floor(transform.index_from_world(set.box_m.min))) - glm::ivec3(0, 1, 0);
  const glm::ivec3 first_brick = brick_of_voxel(first), n = brick_of_voxel(last) - first_brick + 1;
  const auto may_be_active = [&](const glm::dvec3& point_m, std::span<const EvidenceView* const> of_brick) {
    if (set.ground) return point_m.y > set.ground->plane->height_m && ground_allows_matter(set, frames, point_m);
    return may_hold_matter(of_brick, point_m, margin_m);
  };
  const auto n_bricks = static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z);
  std::vector<std::vector<std::uint8_t>> kept(n_bricks);
  const auto brick_at = [&](std::size_t b) {
    const auto s = static_cast<int>(b);
    return first_brick + glm::ivec3(s / (n.y * n.z), s / n.z % n.y, s % n.z);
  };
  std::atomic<std::uint64_t> n_done{0};
  parallel_for(n_bricks, 16, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    for (std::size_t b = begin; b < end; ++b) {
      const glm::ivec3 origin = brick_at(b) * kBrickSide;
      const glm::dvec3 centre_m = transform.world_from_index(glm::dvec3(origin) + 0.5 * (kBrickSide - 1));
      const double radius_m = 0.5 * std::sqrt(3.0) * kBrickSide * transform.voxel_size_m;
      std::vector<const EvidenceView*> of_brick;
      if (!set.ground) of_brick = views_of_ball(views, centre_m, radius_m, margin_m);
      if (!set.ground && of_brick.empty()) continue;
      std::vector<std::uint8_t> active(kBrickVoxels, 0);
      bool any = false;
      for (int v = 0; v < kBrickVoxels; ++v) {
        const glm::ivec3 voxel = origin + voxel_in_brick(v);
        if (glm::any(glm::lessThan(voxel, first)) || glm::any(glm::greaterThan(voxel, last))) continue;
        const glm::dvec3 point_m = transform.world_from_index(glm::dvec3(voxel));
        const bool keep = may_be_active(point_m, of_brick);
        active[static_cast<std::size_t>(v)] = keep ? 1 : 0;
        any |= keep;
      }
      if (any) kept[b] = std::move(active);
    }
    const std::uint64_t done = n_done += end - begin;
    if (worker == 0) monitor.report("carve space", done, n_bricks);
  });
  monitor.report("carve space", n_bricks, n_bricks);
  CarvedVoxels carved;
  for (std::size_t b = 0; b < n_bricks; ++b) {
    if (kept[b].empty()) continue;
    carved.topology.insert(brick_at(b));
    carved.active.insert(carved.active.end(), kept[b].begin(), kept[b].end());
  }
  return carved;
}

OccupancyGrid::OccupancyGrid(const GridTransform& transform, CarvedVoxels voxels)
    : transform_(transform),
      topology_(std::move(voxels.topology)),
      values_(2 * voxels.active.size(), 0.0f) {
  for (std::size_t v = 0; v < voxels.active.size(); ++v)
    if (voxels.active[v] != 0) places_.push_back(static_cast<std::uint32_t>(v));
  refresh(std::vector<float>(places_.size(), 0.0f), -1.0);
}

std::vector<glm::vec3> OccupancyGrid::points_m() const {
  std::vector<glm::vec3> points;
  points.reserve(places_.size());
  for (const std::uint32_t place : places_)
    points.emplace_back(transform_.world_from_index(glm::dvec3(topology_.voxel(place))));
  return points;
}

std::vector<float> OccupancyGrid::extinction_per_m() const {
  std::vector<float> extinction;
  extinction.reserve(places_.size());
  for (const std::uint32_t place : places_) extinction.push_back(values_[2 * std::size_t{place}]);
  return extinction;
}

std::vector<std::uint8_t> OccupancyGrid::dilated(std::span<const std::uint8_t> marked) const {
  // Dilation by a cube of 3³ voxels is separable: one axis after the other.
  std::vector<std::uint8_t> before(marked.begin(), marked.end()), after = before;
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 step(0);
    step[axis] = 1;
    for (std::uint32_t place = 0; place < before.size(); ++place) {
      if (before[place] == 0) continue;
      const glm::ivec3 voxel = topology_.voxel(place);
      for (const glm::ivec3& next : {voxel - step, voxel + step}) {
        const glm::ivec3 brick = brick_of_voxel(next);
        const std::uint32_t number =
            brick == brick_of_voxel(voxel) ? place / kBrickVoxels : topology_.find(brick);
        if (number != kNoBrick)
          after[std::size_t{number} * kBrickVoxels +
                static_cast<std::size_t>(offset_in_brick(next))] = 1;
      }
    }
    before = after;
  }
  return after;
}

void OccupancyGrid::refresh(std::span<const float> extinction_per_m, double least_depth) {
  if (extinction_per_m.size() != places_.size())
    throw UsageError("occupancy grid: expected " + std::to_string(places_.size()) +
                     " extinctions, found " + std::to_string(extinction_per_m.size()));
  least_depth_ = least_depth;
  const auto least_per_m = static_cast<float>(least_depth / (2.0 * transform_.voxel_size_m));
  std::vector<std::uint8_t> dense(values_.size() / 2, 0);
  for (std::size_t n = 0; n < places_.size(); ++n) {
    values_[2 * std::size_t{places_[n]}] = extinction_per_m[n];
    dense[places_[n]] = extinction_per_m[n] > least_per_m ? 1 : 0;
  }
  const std::vector<std::uint8_t> near = dilated(dense);
  std::vector<float> occupied(near.size(), 0.0f);
  n_occupied_ = 0;
  for (const std::uint32_t place : places_) {
    if (near[place] == 0) continue;
    occupied[place] = 1.0f;
    ++n_occupied_;
  }
  occupancy_ =
      std::make_unique<Occupancy>(BrickView<const float>{&topology_, transform_, 1, occupied}, 1);
}

}  // namespace sarnerf
