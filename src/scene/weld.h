// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "triangle_soup.h"

namespace sarnerf {

/// Makes one vertex of all that lie at exactly the same place and belong to faces of the same medium, and
/// drops those that no face uses. Returns how many were merged. CGAL's own function keeps the vertices
/// in a tree, which takes several times as long.
std::uint64_t weld_vertices(TriangleSoup& soup, std::span<const std::uint32_t> medium_of_material);

/// Drops faces that name a vertex twice. Returns how many.
std::uint64_t drop_repeated_corners(TriangleSoup& soup);

/// Keeps the triangles that `keep` marks, with their attributes.
void keep_triangles(TriangleSoup& soup, const std::vector<bool>& keep);

}  // namespace sarnerf
