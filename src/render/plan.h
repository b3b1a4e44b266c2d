// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/volume.h"

namespace sarnerf {

/// Chooses fan and sub-rows for one view and predicts what it will cost; renders nothing. `media_m` is the
/// box of the translucent solids, empty without any.
ViewPlan plan_view(const Scene& scene, const Box& media_m, const Acquisition& acquisition,
                   const Sampling& sampling);

/// The same for the voxel engine; `scene` has the volume's box instead of a mesh.
ViewPlan plan_voxel_view(const Scene& scene, const Volume& volume, const Acquisition& acquisition,
                         const Sampling& sampling);

}  // namespace sarnerf
