// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// Which places of a body are full, `step_m` apart, layer by layer along y; with a margin of one that is empty.
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
  /// Whether a full place has an empty one beside it in its layer.
  bool at_side(const glm::ivec3& p) const {
    return !(full({p.x - 1, p.y, p.z}) && full({p.x + 1, p.y, p.z}) && full({p.x, p.y, p.z - 1}) &&
             full({p.x, p.y, p.z + 1}));
  }

  /// Calls visit(place) for every one that is full, threads by slabs.
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

}  // namespace sarnerf
