// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "lower_envelope.h"

namespace sarnerf {

/// SliceLine::face of the ground.
inline constexpr std::uint32_t kGroundFace = 0xfffffffeu;

/// The infinite ground plane as slices cut it: one and the same line in all of them.
class SliceGround {
 public:
  SliceGround(const Acquisition& view, double height_m);

  /// The part of the ground that the range bins see; none if they end before they reach it.
  const std::optional<SliceLine>& line() const { return line_; }

  /// Replaces `all` by `pieces`, the visible pieces of `lines`, with the ground where it is nearer and, as far as
  /// bins see it, where there is nothing else. `ground`: index of line() among the lines. A piece that lies no
  /// more than a millimetre behind the ground wins: floors and roads lie in the ground's plane.
  void cover(std::span<const VisiblePiece> pieces, std::span<const SliceLine> lines, std::uint32_t ground,
             std::vector<VisiblePiece>& all) const;

 private:
  double plane_depth(double tangent) const;
  /// Depth along k relative to the aim point (m); infinite above the horizon and behind the nadir.
  double depth_at(double tangent) const;

  double slant_range_m_, sine_, cosine_, above_ground_m_;
  std::optional<SliceLine> line_;
};

}  // namespace sarnerf
