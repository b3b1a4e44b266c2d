// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "console.h"
#include "memory_limit.h"
#include "options.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/volume.h"

namespace sarnerf::app {

/// The engine that renders a job, and how it was chosen.
struct BuiltEngine {
  std::unique_ptr<const Engine> engine;
  bool voxel = false;
  double voxel_size_m = 0.0;
  std::uint64_t n_voxels = 0;      ///< occupied
  double voxelise_s = 0.0;
  std::vector<std::string> notes;  ///< what was chosen, and why: for the plan
};

/// A volume file as a scene. Tells the console what reading assumed.
struct LoadedVolume {
  Scene scene;
  Volume volume;
};
LoadedVolume load_volume(const Options& options, const LoadOptions& load, Console& console);

/// Builds what `options` ask for: `auto` takes the surface engine for meshes of homogeneous matter, where it is nearer to
/// the truth at less cost, and the voxel engine for volumes. Writes --save-volume.
BuiltEngine build_engine(const Options& options, const Scene& scene, std::optional<Volume> volume,
                         const MemoryLimit& limit, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
