// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/volume.h"

namespace sarnerf {

/// MPA of a sparse volume: Embree finds where each ray enters occupied matter, the ray is cut into segments
/// there and nowhere else, and their contributions are those of mpa::integrate, as in training. Each ray's
/// contributions are spread over the range that its step of angle covers (departure from the paper, whose
/// rays are points: it would need some hundred rays a pixel for the same evenness).
class VoxelEngine final : public Engine {
 public:
  /// `scene` gives the ground and the box to be framed, and must outlive the engine; its mesh is not looked
  /// at. `coarse`, the same scene in voxels of twice the size, lets views estimate what their voxels cost in
  /// accuracy; without it a volume counts as the truth, and estimates tell of the sampling alone. Throws
  /// GeometryError when there is neither matter nor a ground.
  explicit VoxelEngine(const Scene& scene, Volume volume, std::optional<Volume> coarse = {});
  ~VoxelEngine() override;

  ViewPlan plan(const Acquisition& acquisition, const Sampling& sampling) const override;
  RenderedView render(const ViewPlan& plan, const Monitor& monitor = {}) const override;
  const std::vector<std::string>& warnings() const override;
  std::uint64_t memory_bytes() const override;
  double build_s() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sarnerf
