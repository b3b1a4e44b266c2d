// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "repair.h"

namespace sarnerf {

/// Drops faces on the same three vertices until at most one is left of each: see repair_mesh().
void drop_coincident_faces(TriangleSoup& soup, RepairCounts& counts);

}  // namespace sarnerf
