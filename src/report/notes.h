// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "frame.h"

namespace sarnerf {

/// What the data cover.
struct Obstacles {
  std::vector<Rect> markers;
  std::vector<Stroke> strokes;
};

struct PlacedNote {
  Rect box;
  std::vector<PlacedText> lines;
  std::optional<Stroke> leader;  ///< from the note to its point, when it does not stand beside it
};

struct PlacedNotes {
  std::vector<PlacedNote> notes;
  std::size_t n_omitted = 0;  ///< for want of room
};

/// Finds for each note, in their order, the place around its point that covers least: never a text that stands
/// already nor the rectangles `taken`, rather a line than a marker, rather near than far. Notes outside the
/// limits are left out silently, as points are. O(notes × obstacles).
PlacedNotes place_notes(const Plot& plot, const Frame& frame, const Obstacles& obstacles,
                        std::vector<Rect> taken);

}  // namespace sarnerf
