// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// MPA of a mesh by ray casting: opaque matter by first hits, translucent solids in closed form between
/// entry and exit. Built once, then used for any number of views.
class SurfaceEngine final : public Engine {
 public:
  /// Builds the acceleration structure. `scene` must outlive the engine. Throws GeometryError for a scene without
  /// triangles and ground.
  explicit SurfaceEngine(const Scene& scene);
  ~SurfaceEngine() override;

  ViewPlan plan(const Acquisition& acquisition, const Sampling& sampling) const override;
  RenderedView render(const ViewPlan& plan, const Monitor& monitor = {}) const override;
  const std::vector<std::string>& warnings() const override;
  std::uint64_t memory_bytes() const override;
  double build_s() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Bytes that the engine of a scene with this many triangles is expected to need while it is built.
std::uint64_t expected_engine_memory_bytes(std::uint64_t n_triangles);

}  // namespace sarnerf
