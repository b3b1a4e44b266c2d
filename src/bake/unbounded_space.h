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
/// Points `step_m` apart, about a learned voxel, are tested in 16 horizontal directions: does the way out of the body end at
/// a surface that returns power to a tenth of the views or more? Where it does in fewer than half of the directions, the point
/// is taken out, unless matter is left below it. Two exceptions: a slice of whose sides more than 70 % are such surfaces stays
/// whole, since the rest is wall that returns little, and so does a part of whose lowest sides less than a twentieth is: it
/// stands on something that no view sees.
///
/// `occupancy` is of the frame of the maps through `to_volume`, and 1 in matter. A surface returns power where a map's return
/// lies within three quarters of a step. Memory: a byte and a float for each point of the body's box.
void leave_out_unbounded(openvdb::FloatGrid& occupancy, const GridTransform& to_volume, std::span<const ReturnMap> maps,
                         double step_m, const Monitor& monitor);

}  // namespace sarnerf
