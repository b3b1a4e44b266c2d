// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// One line when much of the mesh is made of faces that meet in concave right angles: dihedral and
/// trihedral corner reflectors answer by double and triple bounces, and an image of single bounces
/// lacks them. Empty otherwise. Meshes of more than 200,000 triangles are not examined: they are scans
/// of shapes rather than drawings of corners.
std::string corner_reflector_warning(const Scene& scene);

}  // namespace sarnerf
