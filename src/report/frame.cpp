// SPDX-License-Identifier: Apache-2.0
#include "frame.h"

#include <algorithm>

#include "series_style.h"
#include "text_metrics.h"

namespace sarnerf {
namespace {

constexpr double kTitleSize = 1.25;
/// The data's share of the picture's height, at least: long titles push the frame's end down instead.
constexpr double kLeastArea = 0.5;
/// Between axis and label of a tick, beyond the tick.
constexpr double kTickGap = 0.35;

double widest_label(const std::vector<Tick>& ticks, double size_px) {
  double width = 0.0;
  for (const Tick& tick : ticks) width = std::max(width, text_width_px(tick.label, size_px));
  return width;
}

/// Title and subtitle from the top; returns where they end.
double add_titles(Frame& frame, const Plot& plot) {
  const double em = plot.text_px, margin = kMargin * em;
  double y = margin;
  const auto add = [&](const std::string& text, double size_px, bool bold, std::string_view colour,
                       std::size_t max_lines) {
    for (std::string& line :
         wrap_text(clean_text(text), size_px, plot.width_px - 2.0 * margin, max_lines, bold)) {
      frame.texts.push_back({std::move(line),
                             {margin, y + kAscent * size_px},
                             size_px,
                             Anchor::start,
                             colour,
                             bold,
                             false});
      y += kLineHeight * size_px;
    }
  };
  add(plot.title, kTitleSize * em, true, kInk, 2);
  add(plot.subtitle, em, false, kQuietInk, 3);
  return y;
}

/// As many labelled ticks as stand apart: `extent_px(label)` is what each takes along the axis of
/// `length_px`.
template <class Extent>
std::vector<Tick> ticks_with_room(const AxisRange& range, double length_px, double gap_px,
                                  Extent extent_px) {
  for (int most = kMostLabels;; --most) {
    auto found = ticks(range.scale, range.low, range.high, most);
    double end = -1e9;
    bool apart = true;
    for (const Tick& tick : found) {
      if (tick.label.empty()) continue;
      const double centre = range.share(tick.value) * length_px, half = 0.5 * extent_px(tick.label);
      apart = apart && centre - half >= end;
      end = centre + half + gap_px;
    }
    if (apart || most <= 1) return found;
  }
}

}  // namespace

Frame frame_of(const Plot& plot, double width_px) {
  const double em = plot.text_px, margin = kMargin * em, line = kLineHeight * em;
  const double beside_tick = (kTickLength + kTickGap) * em;
  Frame frame;
  frame.x = x_range(plot);
  frame.y = y_range(plot);
  const double titles_end = add_titles(frame, plot);
  frame.area.y0 = titles_end + (titles_end > margin ? 0.7 : 0.3) * em;

  const auto x_label = wrap_text(clean_text(plot.x.label), em, 0.75 * width_px, 2);
  const double below =
      beside_tick + line + (x_label.empty() ? 0.0 : 0.25 * em) + double(x_label.size()) * line;
  frame.area.y1 =
      std::max(plot.height_px - margin - below, frame.area.y0 + kLeastArea * plot.height_px);
  frame.bottom_px = frame.area.y1 + below;

  frame.y_ticks = ticks_with_room(frame.y, frame.area.height(), 0.3 * em,
                                  [&](const std::string&) { return em; });
  const auto y_label = wrap_text(clean_text(plot.y.label), em, frame.area.height(), 2);
  const double tick_text = widest_label(frame.y_ticks, em);
  frame.area.x0 = margin + double(y_label.size()) * line + tick_text + beside_tick;
  frame.area.x1 = width_px - margin;
  const auto width_of = [&](const std::string& label) { return text_width_px(label, em); };
  // Labels centred under the outer ticks may reach beyond the picture. Moving the area's edges moves the ticks,
  // by less, and may leave room for fewer: the second round sees to that.
  for (int round = 0; round < 3; ++round) {
    frame.x_ticks = ticks_with_room(frame.x, frame.area.width(), 0.7 * em, width_of);
    const Rect now = frame.area;
    for (const Tick& tick : frame.x_ticks) {
      const double share = frame.x.share(tick.value), half = 0.5 * width_of(tick.label) + 0.4 * em;
      frame.area.x0 = std::max(frame.area.x0, half - share * now.width());
      frame.area.x1 = std::min(frame.area.x1, width_px - half + (1.0 - share) * now.width());
    }
  }

  const double centred = 0.5 * kCapHeight * em;
  for (const Tick& tick : frame.y_ticks) {
    if (tick.label.empty()) continue;
    frame.texts.push_back({tick.label,
                           {frame.area.x0 - beside_tick, frame.y_px(tick.value) + centred},
                           em,
                           Anchor::end,
                           kQuietInk});
  }
  double y = frame.area.y1 + beside_tick + kAscent * em;
  for (const Tick& tick : frame.x_ticks) {
    if (tick.label.empty()) continue;
    frame.texts.push_back({tick.label, {frame.x_px(tick.value), y}, em, Anchor::middle, kQuietInk});
  }
  y += 0.25 * em;
  const double middle_x = 0.5 * (frame.area.x0 + frame.area.x1);
  for (const std::string& text : x_label) {
    frame.texts.push_back({text, {middle_x, y += line}, em, Anchor::middle, kInk});
  }
  double x = margin + kAscent * em;
  const double middle_y = 0.5 * (frame.area.y0 + frame.area.y1);
  for (const std::string& text : y_label) {
    frame.texts.push_back({text, {x, middle_y}, em, Anchor::middle, kInk, false, true});
    x += line;
  }
  return frame;
}

}  // namespace sarnerf
