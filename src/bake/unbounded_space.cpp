// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "return_map.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

namespace {

/// Full points of a body, sampled `step_m` apart, in layers along y; with an empty margin of one point.
class BodyPlaces {
 public:
  BodyPlaces(const openvdb::FloatGrid& occupancy, const GridTransform& to_volume, double step_m);

  const glm::ivec3& size() const { return size_; }
  std::size_t n() const { return full_.size(); }
  glm::dvec3 point_m(const glm::ivec3& p) const { return first_m_ + step_m_ * glm::dvec3(p); }
  glm::dvec3 place_of(const glm::dvec3& point_m) const { return (point_m - first_m_) / step_m_; }
  std::size_t index(const glm::ivec3& p) const {
    const auto u = [](int i) { return static_cast<std::size_t>(i); };
    return (u(p.x) * u(size_.y) + u(p.y)) * u(size_.z) + u(p.z);
  }
  bool holds(const glm::ivec3& p) const {
    return glm::all(glm::greaterThanEqual(p, glm::ivec3(0))) && glm::all(glm::lessThan(p, size_));
  }
  bool full(const glm::ivec3& p) const { return holds(p) && full_[index(p)] != 0; }
  /// Whether a full point has an empty neighbour in its layer.
  bool at_side(const glm::ivec3& p) const {
    return !(full({p.x - 1, p.y, p.z}) && full({p.x + 1, p.y, p.z}) && full({p.x, p.y, p.z - 1}) &&
             full({p.x, p.y, p.z + 1}));
  }

  /// Calls visit(place) for every full point, slabs in parallel.
  template <class Visit>
  void for_each_full(const Monitor& monitor, Visit&& visit) const {
    parallel_for(static_cast<std::size_t>(size_.x), 1, [&](std::size_t begin, std::size_t end, int) {
      monitor.check();
      for (int x = static_cast<int>(begin); x < static_cast<int>(end); ++x)
        for (int y = 0; y < size_.y; ++y)
          for (int z = 0; z < size_.z; ++z)
            if (full({x, y, z})) visit(glm::ivec3(x, y, z));
    });
  }

 private:
  double step_m_;
  glm::dvec3 first_m_{0.0};
  glm::ivec3 size_{0};
  std::vector<std::uint8_t> full_;
};

BodyPlaces::BodyPlaces(const openvdb::FloatGrid& occupancy, const GridTransform& to_volume, double step_m)
    : step_m_(step_m) {
  const openvdb::CoordBBox box = occupancy.evalActiveVoxelBoundingBox();
  const auto centre_m = [&](const openvdb::Coord& c) {
    return to_volume.world_from_index(glm::dvec3(c.x(), c.y(), c.z()));
  };
  // Layer 0 is the margin, layer 1 half a step above the lowest voxel.
  first_m_ = centre_m(box.min()) - 0.5 * step_m;
  size_ = glm::ivec3(glm::ceil((centre_m(box.max()) - first_m_) / step_m)) + 2;
  full_.assign(index({size_.x - 1, size_.y - 1, size_.z - 1}) + 1, 0);
  parallel_for(static_cast<std::size_t>(size_.x), 1, [&](std::size_t begin, std::size_t end, int) {
    const openvdb::FloatGrid::ConstAccessor values = occupancy.getConstAccessor();
    for (int x = static_cast<int>(begin); x < static_cast<int>(end); ++x)
      for (int y = 0; y < size_.y; ++y)
        for (int z = 0; z < size_.z; ++z) {
          const glm::ivec3 v(glm::round(to_volume.index_from_world(point_m({x, y, z}))));
          full_[index({x, y, z})] = values.getValue({v.x, v.y, v.z}) >= 0.5f ? 1 : 0;
        }
  });
}

/// A side is seen if at least this fraction of the views have a hit near it, within so many steps between points.
constexpr double kSeen = 0.1, kNear = 0.75;

/// Horizontal directions that are tested, and the fraction of them in which a point of the body must be bounded.
constexpr int kDirections = 16;
constexpr float kBounded = 0.5f;

/// If more than this fraction of a slice's sides are seen, the rest is dark wall.
constexpr double kMostlySeen = 0.7;

/// Lowest layers of a part, and the fraction of their sides that must be seen to determine what the part stands on.
constexpr int kLowLayers = 3;
constexpr double kStandsOnSeen = 0.05;

/// Which points at the body's sides return power to at least kSeen of the views.
std::vector<std::uint8_t> seen_sides(const BodyPlaces& places, std::span<const ReturnMap> maps, double near_m,
                                     const Monitor& monitor) {
  std::vector<std::uint8_t> seen(places.n(), 0);
  places.for_each_full(monitor, [&](const glm::ivec3& p) {
    if (!places.at_side(p)) return;
    const glm::dvec3 point_m = places.point_m(p);
    const auto n = static_cast<std::size_t>(std::count_if(
        maps.begin(), maps.end(), [&](const ReturnMap& map) { return map.meets_near(point_m, near_m); }));
    seen[places.index(p)] = n > 0 && static_cast<double>(n) >= kSeen * static_cast<double>(maps.size()) ? 1 : 0;
  });
  return seen;
}

/// Fraction of the horizontal directions in which a point is behind a seen side.
float share_bounded(const BodyPlaces& places, const std::vector<std::uint8_t>& seen, const glm::ivec3& from) {
  int n_bounded = 0;
  for (int d = 0; d < kDirections; ++d) {
    const double angle = 2.0 * std::numbers::pi * (d + 0.5) / kDirections;
    glm::ivec3 last = from;
    for (double t = 0.5;; t += 0.5) {
      const glm::ivec3 next = from + glm::ivec3(std::lround(t * std::cos(angle)), 0, std::lround(t * std::sin(angle)));
      if (!places.full(next)) break;
      last = next;
    }
    bool bounded = false;  // a path that grazes a corner leaves by a neighbour
    for (int x = -1; x <= 1 && !bounded; ++x)
      for (int z = -1; z <= 1 && !bounded; ++z) {
        const glm::ivec3 side = last + glm::ivec3(x, 0, z);
        bounded = places.full(side) && seen[places.index(side)] != 0;
      }
    n_bounded += bounded ? 1 : 0;
  }
  return static_cast<float>(n_bounded) / kDirections;
}

/// Calls visit(points) for each connected component of full points under the given neighbourhood.
template <class Visit>
void for_each_piece(const BodyPlaces& places, std::span<const glm::ivec3> neighbours, Visit&& visit) {
  std::vector<std::uint8_t> found(places.n(), 0);
  std::vector<glm::ivec3> piece;
  for (int x = 0; x < places.size().x; ++x)
    for (int y = 0; y < places.size().y; ++y)
      for (int z = 0; z < places.size().z; ++z) {
        if (!places.full({x, y, z}) || found[places.index({x, y, z})] != 0) continue;
        piece = {glm::ivec3(x, y, z)};
        found[places.index(piece[0])] = 1;
        for (std::size_t n = 0; n < piece.size(); ++n)
          for (const glm::ivec3& step : neighbours) {
            const glm::ivec3 next = piece[n] + step;
            if (!places.full(next) || found[places.index(next)] != 0) continue;
            found[places.index(next)] = 1;
            piece.push_back(next);
          }
        visit(std::span<const glm::ivec3>(piece));
      }
}

/// Neighbours in the same layer come first.
constexpr std::array<glm::ivec3, 6> kNeighbours = {glm::ivec3(-1, 0, 0), glm::ivec3(1, 0, 0),  glm::ivec3(0, 0, -1),
                                                   glm::ivec3(0, 0, 1),  glm::ivec3(0, -1, 0), glm::ivec3(0, 1, 0)};

/// Fraction of a piece's sides, up to the layer `highest`, that are seen.
double share_seen(const BodyPlaces& places, const std::vector<std::uint8_t>& seen, std::span<const glm::ivec3> piece,
                  int highest) {
  std::size_t n_sides = 0, n_seen = 0;
  for (const glm::ivec3& p : piece)
    if (p.y <= highest && places.at_side(p)) ++n_sides, n_seen += seen[places.index(p)];
  return n_sides == 0 ? 0.0 : static_cast<double>(n_seen) / static_cast<double>(n_sides);
}

/// Keeps all above a kept point. A column's lowest point takes the value of the next: half of it may be in the ground.
void keep_above_matter(const BodyPlaces& places, std::vector<float>& share) {
  const glm::ivec3 n = places.size();
  for (int x = 0; x < n.x; ++x)
    for (int z = 0; z < n.z; ++z) {
      bool open = true;
      for (int y = 0; y < n.y; ++y) {
        if (!places.full({x, y, z})) continue;
        float& here = share[places.index({x, y, z})];
        if (!places.full({x, y - 1, z}) && places.full({x, y + 1, z})) here = share[places.index({x, y + 1, z})];
        open = open && here < kBounded;
        if (!open) here = 1.0f;
      }
    }
}

/// Bounded fraction, interpolated linearly between full points; empty points are ignored.
class Boundedness {
 public:
  Boundedness(const BodyPlaces& places, const std::vector<float>& share) : places_(places), share_(share) {}

  float at(const glm::dvec3& point_m) const {
    const glm::dvec3 place = places_.place_of(point_m);
    const glm::ivec3 low(glm::floor(place));
    const glm::dvec3 u = place - glm::dvec3(low);
    double sum = 0.0, weight = 0.0;
    for (int c = 0; c < 8; ++c) {
      const glm::ivec3 step(c >> 2, c >> 1 & 1, c & 1);
      if (!places_.full(low + step)) continue;
      const glm::dvec3 w = glm::mix(1.0 - u, u, glm::dvec3(step));
      const double part = w.x * w.y * w.z;
      sum += part * double{share_[places_.index(low + step)]};
      weight += part;
    }
    return weight > 0.0 ? static_cast<float>(sum / weight) : 1.0f;
  }

 private:
  const BodyPlaces& places_;
  const std::vector<float>& share_;
};

}  // namespace

void leave_out_unbounded(openvdb::FloatGrid& occupancy, const GridTransform& to_volume, std::span<const ReturnMap> maps,
                         double step_m, const Monitor& monitor) {
  if (occupancy.empty() || maps.empty()) return;
  monitor.report("removing space under the body", 0, 1);
  const BodyPlaces places(occupancy, to_volume, std::max(step_m, to_volume.voxel_size_m));
  const std::vector<std::uint8_t> seen = seen_sides(places, maps, kNear * step_m, monitor);
  std::vector<float> share(places.n(), 1.0f);
  places.for_each_full(monitor, [&](const glm::ivec3& p) { share[places.index(p)] = share_bounded(places, seen, p); });
  const auto leave = [&](std::span<const glm::ivec3> piece) {
    for (const glm::ivec3& p : piece) share[places.index(p)] = 1.0f;
  };
  for_each_piece(places, std::span(kNeighbours).first(4), [&](std::span<const glm::ivec3> slice) {
    if (share_seen(places, seen, slice, slice.front().y) > kMostlySeen) leave(slice);
  });
  for_each_piece(places, kNeighbours, [&](std::span<const glm::ivec3> part) {
    const auto lower = [](const glm::ivec3& a, const glm::ivec3& b) { return a.y < b.y; };
    const int lowest = std::min_element(part.begin(), part.end(), lower)->y;
    if (share_seen(places, seen, part, lowest + kLowLayers - 1) < kStandsOnSeen) leave(part);
  });

  keep_above_matter(places, share);

  // Leaves that contain or touch a point that is not bounded.
  std::vector<openvdb::Coord> origins;
  for (int x = 0; x < places.size().x; ++x)
    for (int y = 0; y < places.size().y; ++y)
      for (int z = 0; z < places.size().z; ++z) {
        if (share[places.index({x, y, z})] >= kBounded) continue;
        const glm::ivec3 low(glm::floor(to_volume.index_from_world(places.point_m({x - 1, y - 1, z - 1}))));
        const glm::ivec3 high(glm::ceil(to_volume.index_from_world(places.point_m({x + 1, y + 1, z + 1}))));
        const glm::ivec3 first = brick_of_voxel(low), last = brick_of_voxel(high);
        for (int i = first.x; i <= last.x; ++i)
          for (int j = first.y; j <= last.y; ++j)
            for (int k = first.z; k <= last.z; ++k) {
              const glm::ivec3 origin = kBrickSide * glm::ivec3(i, j, k);
              origins.emplace_back(origin.x, origin.y, origin.z);
            }
      }
  std::sort(origins.begin(), origins.end());
  origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
  std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
  for (const openvdb::Coord& origin : origins)
    if (occupancy.tree().probeConstLeaf(origin) != nullptr || occupancy.tree().isValueOn(origin))
      leaves.push_back(occupancy.tree().touchLeaf(origin));

  const Boundedness bounded(places, share);
  parallel_for(leaves.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    for (std::size_t l = begin; l < end; ++l)
      for (auto value = leaves[l]->beginValueOn(); value; ++value) {
        const openvdb::Coord c = value.getCoord();
        const float share_there = bounded.at(to_volume.world_from_index(glm::dvec3(c.x(), c.y(), c.z())));
        const float left = std::min(value.getValue(), std::clamp(0.5f + 4.0f * (share_there - kBounded), 0.0f, 1.0f));
        if (left > 0.0f) {
          value.setValue(left);
        } else {
          leaves[l]->setValueOff(value.pos(), 0.0f);
        }
      }
  });
}

}  // namespace sarnerf
