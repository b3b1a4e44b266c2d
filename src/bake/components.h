// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/bake/surface_mesh.h"

namespace sarnerf {

/// Number of each vertex's component (vertices that triangles connect), in the order of their first vertices; their count last.
std::vector<std::uint32_t> components_of(const SurfaceMesh& mesh);

/// Length, width and height (m) of the component with the largest area: from the 1st to the 99th percentile of its area, along the
/// principal axis of its area's horizontal distribution, across it, and vertically. 0 for a mesh without area. Percentiles leave
/// out antennas, and single voxels at the border of what was learned. Cost: a sort of the triangles for each axis.
glm::dvec3 largest_component_m(const SurfaceMesh& mesh);

}  // namespace sarnerf
