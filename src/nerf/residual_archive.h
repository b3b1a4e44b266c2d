// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/view_residuals.h"

namespace sarnerf {

/// Adds residuals as half-precision numbers: they are a hundredth of the power, at best.
void add_residuals(Archive& archive, const ViewResiduals& residuals);

/// Null where the archive has none. Throws CheckpointError for damaged ones.
std::shared_ptr<const ViewResiduals> residuals_of(const Archive& archive, const std::string& where);

}  // namespace sarnerf
