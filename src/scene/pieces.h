// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "repair.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// What decides how a connected piece is taken.
struct PieceShape {
  Box box;
  double signed_volume = 0.0;  ///< negative when the faces look inward
  bool closed = true;          ///< without border, and not flat
  bool as_drawn = true;        ///< no face was turned to agree with its neighbours
};

/// Fills mesh.piece: triangles that a smooth edge joins share a piece; pieces are numbered in the order of
/// their first triangles. `turned`: per triangle, whether orientation reversed it.
std::vector<PieceShape> find_pieces(RepairedMesh& mesh, const std::vector<bool>& turned);

inline constexpr std::uint32_t kNoPiece = 0xffffffffu;

/// For each piece the one whose cavity it is, or kNoPiece: closed pieces that were drawn looking inward,
/// inside the smallest closed piece around them, which was drawn looking outward. Where everything looks
/// inward, the file is inside out and nothing is a cavity.
std::vector<std::uint32_t> find_cavities(const RepairedMesh& mesh,
                                         const std::vector<PieceShape>& pieces,
                                         std::span<const std::uint32_t> medium_of_material,
                                         const Monitor& monitor);

}  // namespace sarnerf
