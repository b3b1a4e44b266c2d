// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// Box of the vertices that triangles use; empty for a mesh without triangles. Throws InputError, naming the
/// mesh, for corners that do not exist and for coordinates that are not finite.
Box checked_box(const SurfaceMesh& mesh, const std::string& name);

}  // namespace sarnerf
