// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sarnerf/render/surface_engine.h"
#include "studies.h"

namespace sarnerf::bench {

struct NamedScene {
  std::string name;
  Scene scene;
};

/// The scenes named in the options, or two generated ones.
std::vector<NamedScene> load_scenes(const StudyOptions& options);

/// The view that all studies take, centred on the scene.
Acquisition standard_view(const Scene& scene, const StudyOptions& options);

}  // namespace sarnerf::bench
