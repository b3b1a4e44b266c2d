// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "appearance.h"
#include "slice.h"

namespace sarnerf {

/// Fills `slice.gamma` of the rays from their hits: `slice.surface`, `slice.cosine` and, in `scratch`,
/// origins and distances. Returns the number of hits. Cost: linear, vectorised over runs of rays
/// whose hits share their appearance.
std::uint64_t shade(const ViewRays& rays, const AppearanceTable& table,
                    const SliceBlock::Rays& scratch, Slice& slice);

}  // namespace sarnerf
