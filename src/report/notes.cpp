// SPDX-License-Identifier: Apache-2.0
#include "notes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "series_style.h"
#include "text_metrics.h"

namespace sarnerf {
namespace {

constexpr std::size_t kMostLines = 3;
constexpr int kDirections = 24;
/// Distances from the point to try, in text sizes.
constexpr std::array<double, 11> kDistances{0.75, 1.2, 1.8,  2.6,  3.6, 5.0,
                                            7.0,  9.0, 11.0, 14.0, 18.0};

// What covering costs, in text sizes of distance.
constexpr double kMarkerCost = 12.0;
constexpr double kStrokeCost = 6.0;
constexpr double kLeaderCost = 6.0;
// And what a leader's crossing costs.
constexpr double kMarkerCrossing = 3.0;
constexpr double kTextCrossing = 8.0;

/// The rectangle's point nearest to `spot`.
Spot nearest(const Rect& rect, Spot spot) {
  return {std::clamp(spot.x, rect.x0, rect.x1), std::clamp(spot.y, rect.y0, rect.y1)};
}

/// From the point's edge to the note, when they are apart.
std::optional<Stroke> leader_of(const Rect& box, Spot spot, double em) {
  const Spot end = nearest(box, spot);
  const double dx = end.x - spot.x, dy = end.y - spot.y, length = std::hypot(dx, dy);
  const double skipped = 0.6 * em;
  if (length < 1.5 * em) return std::nullopt;
  return Stroke{{spot.x + dx * skipped / length, spot.y + dy * skipped / length}, end};
}

/// Places already given away.
struct Taken {
  std::vector<Rect> boxes;
  std::vector<Stroke> leaders;
};

double cost(const Rect& box, const std::optional<Stroke>& leader, const Obstacles& obstacles,
            const Taken& taken) {
  double sum = 0.0;
  for (const Rect& marker : obstacles.markers) {
    if (overlap(box, marker)) sum += kMarkerCost;
    if (leader && crosses(*leader, marker)) sum += kMarkerCrossing;
  }
  for (const Stroke& stroke : obstacles.strokes) {
    if (crosses(stroke, box)) sum += kStrokeCost;
  }
  for (const Stroke& other : taken.leaders) {
    if (crosses(other, box)) sum += kLeaderCost;
  }
  if (!leader) return sum;
  for (const Rect& other : taken.boxes) {
    if (crosses(*leader, other)) sum += kTextCrossing;
  }
  return sum;
}

}  // namespace

PlacedNotes place_notes(const Plot& plot, const Frame& frame, const Obstacles& obstacles,
                        std::vector<Rect> taken_boxes) {
  const double em = plot.text_px;
  Taken taken{std::move(taken_boxes), {}};
  PlacedNotes placed;
  for (const PlotNote& note : plot.notes) {
    const PlotPoint point{note.x, note.y};
    auto lines = wrap_text(clean_text(note.text), em, 0.35 * frame.area.width(), kMostLines);
    if (lines.empty() || !frame.shows(point)) continue;
    double width = 0.0;
    for (const std::string& line : lines) width = std::max(width, text_width_px(line, em));
    const double height = (kAscent + kDescent + kLineHeight * double(lines.size() - 1)) * em;
    const Spot spot = frame.spot(point);

    std::optional<Rect> best;
    double least = 1e300;
    for (const double distance : kDistances) {
      for (int d = 0; d < kDirections; ++d) {
        // First to the upper right, then around.
        const double angle = 2.0 * std::numbers::pi * (d + 2) / kDirections;
        const double c = std::cos(angle), s = -std::sin(angle);
        // Beside the point at that distance, whatever the note's size: its centre moves from a
        // side's middle to a corner with the direction.
        const Spot centre{
            spot.x + distance * em * c + 0.5 * width * std::clamp(1.6 * c, -1.0, 1.0),
            spot.y + distance * em * s + 0.5 * height * std::clamp(1.6 * s, -1.0, 1.0)};
        const Rect box{centre.x - 0.5 * width, centre.y - 0.5 * height, centre.x + 0.5 * width,
                       centre.y + 0.5 * height};
        if (!frame.area.holds(box.grown(0.15 * em))) continue;
        const Rect roomy = box.grown(0.2 * em);
        const bool on_text = std::any_of(taken.boxes.begin(), taken.boxes.end(),
                                         [&](const Rect& other) { return overlap(roomy, other); });
        if (on_text) continue;
        const double sum = distance + cost(roomy, leader_of(box, spot, em), obstacles, taken);
        if (sum < least) {
          least = sum;
          best = box;
        }
      }
    }
    if (!best) {
      ++placed.n_omitted;
      continue;
    }
    PlacedNote result{*best, {}, leader_of(*best, spot, em)};
    double baseline = best->y0 + kAscent * em;
    // Lines lie against the side that faces the point.
    const bool leftwards = best->x1<spot.x, rightwards = best->x0> spot.x;
    const Anchor anchor = leftwards ? Anchor::end : rightwards ? Anchor::start : Anchor::middle;
    const double x = leftwards ? best->x1 : rightwards ? best->x0 : 0.5 * (best->x0 + best->x1);
    for (std::string& line : lines) {
      result.lines.push_back({std::move(line), {x, baseline}, em, anchor, kInk});
      baseline += kLineHeight * em;
    }
    taken.boxes.push_back(*best);
    if (result.leader) taken.leaders.push_back(*result.leader);
    placed.notes.push_back(std::move(result));
  }
  return placed;
}

}  // namespace sarnerf
