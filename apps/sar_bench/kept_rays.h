// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/render/surface_engine.h"
#include "triangle_subset.h"
#include "view_rays.h"

namespace sarnerf::bench {

/// Exactly the rays that the surface engine keeps for one view, laid out beforehand, with nothing left
/// to do but to trace them: the bound that the engine is measured against.
class KeptRays {
 public:
  KeptRays(const Scene& scene, const ViewPlan& plan);

  std::size_t count() const { return count_; }

  void trace_row_packets();     ///< packets of 16 neighbours along a slice
  void trace_square_packets();  ///< packets of 4 slices by 4 rays
  void trace_one_by_one();

 private:
  struct Block {
    std::size_t first, n_rays;
    std::vector<std::vector<float>> x, y, z;  ///< origins, one array per slice
  };
  RayRow row(const Block& block, std::size_t slice) const;
  HitRow hits(std::size_t slice, std::size_t n);

  TriangleSubset mesh_;
  RayTracer tracer_;
  ViewRays rays_;
  std::vector<Block> blocks_;
  std::size_t count_ = 0;
  std::vector<float> distance_, normal_x_, normal_y_, normal_z_;
  std::vector<std::uint32_t> triangle_;
};

}  // namespace sarnerf::bench
