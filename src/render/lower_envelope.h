// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "slice_line.h"

namespace sarnerf {

/// Rays, by the tangents of their angles, that see one line first.
struct VisiblePiece {
  double first, last;
  std::uint32_t line;  ///< index into the lines
};

/// Which of a slice's lines is nearest to the radar, for every ray there is: between neighbouring ends of lines
/// the lines that rays meet do not change, and what is nearest at both borders of an interval is nearest all
/// over it; otherwise the interval is divided where the two nearest change places. Lines may cross, touch and
/// coincide; of lines nowhere more than a nanometre apart either may win.
/// Cost: n log n for n ends, and a few ns for each line of each interval.
class LowerEnvelope {
 public:
  explicit LowerEnvelope(double slant_range_m) : r_(slant_range_m) {}

  /// Replaces `pieces`, in order of angle, without those that see nothing.
  void find(std::span<const SliceLine> lines, std::vector<VisiblePiece>& pieces);

 private:
  struct End {
    double tangent;
    std::uint32_t line;
    bool begins;
  };

  /// Of the active lines, at a ray that all of them meet.
  std::uint32_t nearest(double tangent) const;
  void divide(double first, std::uint32_t at_first, double last, std::uint32_t at_last, int depth);
  void add(double first, double last, std::uint32_t line);
  double depth_at(std::uint32_t line, double tangent) const { return lines_[line].depth_at(tangent, r_); }

  double r_;
  std::span<const SliceLine> lines_;
  std::vector<VisiblePiece>* pieces_ = nullptr;
  std::vector<End> ends_;
  std::vector<std::uint32_t> active_;
};

/// Where, between two rays, line a, which is nearer by `before_m` at the first, changes places with line b, which
/// is nearer by `behind_m` at the last; neither is negative, and not both are zero. `depths_m`: of a and b from
/// the radar, at both rays.
double crossing(double first, double last, double before_m, double behind_m, glm::dvec2 first_depths_m,
                glm::dvec2 last_depths_m);

}  // namespace sarnerf
