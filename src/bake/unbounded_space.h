// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <span>

#include "return_map.h"
#include "sarnerf/core/monitor.h"

namespace sarnerf {

/// Takes out of a body what no view sees into and no seen surface bounds, as the space under a vehicle, between its
/// wheels. Views leave it full, since none looks in; yet its sides are where rays happen to end, and nothing returns
/// from there.
///
/// Of 16 horizontal directions, those count in which the way out of the body ends at a surface that returns power: to a
/// tenth of the views at least. Where they are less than half of all, the place is taken out, unless matter is left below
/// it. A slice most of whose sides are seen stays whole, since the rest is wall that returns little; and so does a part
/// whose lowest layers show no such surface at all: it stands on something that nobody sees.
///
/// `occupancy` is of the frame of the maps through `to_volume`, and 1 in matter; `step_m` is the distance of the places
/// that are asked, about a learned voxel, and how near a surface returns have to be three quarters of it. Cost: those
/// places of the body's box are kept, a byte and a float each.
void leave_out_unbounded(openvdb::FloatGrid& occupancy, const GridTransform& to_volume, std::span<const ReturnMap> maps,
                         double step_m, const Monitor& monitor);

}  // namespace sarnerf
