// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/render/surface_engine.h"

namespace sarnerf {

/// Chooses fan and sub-rows for one view and predicts what it will cost; renders nothing.
ViewPlan plan_view(const Scene& scene, const Acquisition& acquisition, const Sampling& sampling);

}  // namespace sarnerf
