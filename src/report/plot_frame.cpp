// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>

#include "plot_layout.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "svg.h"

namespace sarnerf {

namespace {

const std::string kMinus = "\xE2\x88\x92";  // −
const std::string kTimesTen =
    "\xC2\xB7"
    "10";  // ·10

/// m × 10^e, correctly rounded if 10^|e| is exact: 3 × 10⁻¹ is 0.3, not 3 × 0.1.
double scaled(double m, int e) { return e < 0 ? m / std::pow(10.0, -e) : m * std::pow(10.0, e); }

std::string superscript(int exponent) {
  static const std::array<std::string, 10> digits{
      "\xE2\x81\xB0", "\xC2\xB9",     "\xC2\xB2",     "\xC2\xB3",     "\xE2\x81\xB4",
      "\xE2\x81\xB5", "\xE2\x81\xB6", "\xE2\x81\xB7", "\xE2\x81\xB8", "\xE2\x81\xB9"};
  std::string text = exponent < 0 ? "\xE2\x81\xBB" : "";
  for (const char digit : std::to_string(std::abs(exponent)))
    text += digits[std::size_t(digit - '0')];
  return text;
}

/// m × 10^e written out: 250, 0.025.
std::string plain_label(long long m, int e) { return (m < 0 ? kMinus : "") + decimal_text(std::llabs(m), e); }

/// m × 10^e as 2.5·10⁻⁷; a power of ten as 10⁻⁷.
std::string power_label(long long m, int e) {
  if (m == 0) return "0";
  std::string digits = std::to_string(std::llabs(m));
  const int exponent = e + int(digits.size()) - 1;
  while (digits.size() > 1 && digits.back() == '0') digits.pop_back();
  const std::string sign = m < 0 ? kMinus : "";
  if (digits == "1") return sign + "10" + superscript(exponent);
  if (digits.size() > 1) digits.insert(1, ".");
  return sign + digits + kTimesTen + superscript(exponent);
}

/// A tick at m × 10^e.
struct Place {
  long long m = 0;
  int e = 0;
  double value() const { return scaled(double(m), e); }
};

/// Whether a value lies within the limits, with a tolerance so that rounding does not drop a tick on a limit.
bool within(double value, double low, double high) {
  const double slack = 1e-12 * std::max(std::abs(low), std::abs(high));
  return value >= low - slack && value <= high + slack;
}

/// The numbers m × 10^e within the limits, for each m in `of`.
std::vector<Place> multiples(double low, double high, std::initializer_list<int> of) {
  std::vector<Place> places;
  const int first = int(std::floor(std::log10(low))) - 1,
            last = int(std::ceil(std::log10(high))) + 1;
  for (int e = first; e <= last; ++e) {
    for (const int m : of) {
      if (within(scaled(m, e), low, high)) places.push_back({m, e});
    }
  }
  return places;
}

/// Every `step`-th power of ten, counted from 10⁰.
std::vector<Place> every(const std::vector<Place>& decades, int step) {
  std::vector<Place> kept;
  for (const Place& p : decades) {
    if (p.e % step == 0) kept.push_back(p);
  }
  return kept;
}

/// All labels of an axis have one form: written out if all are short, else as powers of ten.
void add_labelled(std::vector<Tick>& ticks, const std::vector<Place>& places) {
  const bool plain = std::all_of(places.begin(), places.end(), [](const Place& p) {
    return p.value() > 0.9e-3 && p.value() < 1.1e4;
  });
  for (const Place& p : places) {
    ticks.push_back({p.value(), plain ? plain_label(p.m, p.e) : power_label(p.m, p.e)});
  }
}

void add_minor(std::vector<Tick>& ticks, const std::vector<Place>& places) {
  for (const Place& p : places) ticks.push_back({p.value()});
}

}  // namespace

std::vector<Tick> linear_ticks(double low, double high, int most_labels) {
  // Starts at a step that is certainly too small.
  int e = int(std::floor(std::log10(high - low))) - 2;
  for (;; ++e) {
    for (const int m : {1, 2, 5}) {
      const double step = scaled(m, e);
      // A tolerance for a tick on a limit, as in within().
      const double slack = 1e-12 * std::max(std::abs(low), std::abs(high)) / step;
      const auto first = (long long)(std::ceil(low / step - slack));
      const auto last = (long long)(std::floor(high / step + slack));
      if (last - first + 1 > most_labels) continue;
      const double largest = std::max(std::abs(low), std::abs(high));
      const bool plain = largest < 1e6 && (e > -6 || largest >= 1e-3);
      std::vector<Tick> ticks;
      for (long long n = first; n <= last; ++n) {
        ticks.push_back(
            {scaled(double(n * m), e), plain ? plain_label(n * m, e) : power_label(n * m, e)});
      }
      return ticks;
    }
  }
}

std::vector<Tick> log_ticks(double low, double high, int most_labels) {
  std::vector<Tick> ticks;
  const auto decades = multiples(low, high, {1});
  const auto fine = multiples(low, high, {1, 2, 5});
  const auto most = std::size_t(most_labels);
  if (decades.size() >= 3 || (fine.size() > most && !decades.empty())) {
    int step = 1;
    for (const int larger : {1, 2, 3, 5, 10, 20, 30, 50, 100, 200}) {
      step = larger;
      if (every(decades, step).size() <= most) break;
    }
    add_labelled(ticks, every(decades, step));
    if (step > 1) {
      for (const Place& p : decades) {
        if (p.e % step != 0) add_minor(ticks, {p});
      }
    } else {
      add_minor(ticks, multiples(low, high, {2, 5}));
    }
  } else if (fine.size() >= 3 && fine.size() <= most) {
    add_labelled(ticks, fine);
    add_minor(ticks, multiples(low, high, {3, 4, 6, 7, 8, 9}));
  } else {
    ticks = linear_ticks(low, high, most_labels);
  }
  std::sort(ticks.begin(), ticks.end(),
            [](const Tick& a, const Tick& b) { return a.value < b.value; });
  return ticks;
}

std::vector<Tick> ticks(AxisScale scale, double low, double high, int most_labels) {
  return scale == AxisScale::log ? log_ticks(low, high, most_labels)
                                 : linear_ticks(low, high, most_labels);
}

namespace {

/// Larger values could overflow when multiplied by pixels.
constexpr double kLargest = 1e100;
/// Room beyond the data, as a fraction of its extent.
constexpr double kRoom = 0.04;
/// Smallest distance of the limits, as a fraction of the larger one: labels then differ within seven digits.
constexpr double kNarrowest = 1e-6;

std::string text_of(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return {buffer, end};
}

void check(double value, AxisScale scale, const std::string& where) {
  if (!std::isfinite(value) || std::abs(value) > kLargest) {
    throw UsageError(where + ": expected a number of magnitude up to 1e100, found " +
                     text_of(value) + "; leave such points out of the plot");
  }
  if (scale == AxisScale::log && value < 1.0 / kLargest) {
    throw UsageError(where + ": expected a value above zero for a logarithmic axis, found " +
                     text_of(value) + "; leave it out or take a linear axis");
  }
}

void check_limits(const PlotAxis& axis, const std::string& name) {
  if (axis.low) check(*axis.low, axis.scale, "plot: lower limit of " + name);
  if (axis.high) check(*axis.high, axis.scale, "plot: upper limit of " + name);
  if (!axis.low || !axis.high) return;
  const double least = kNarrowest * std::max(std::abs(*axis.low), std::abs(*axis.high));
  if (!(*axis.high - *axis.low >= least) || *axis.low == *axis.high) {
    throw UsageError("plot: limits of " + name +
                     ": expected an upper limit above the lower one by at least a "
                     "millionth of it, found " +
                     text_of(*axis.low) + " to " + text_of(*axis.high));
  }
}

/// Smallest and largest value.
struct Extent {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

AxisRange linear_range(const PlotAxis& axis, Extent data) {
  double low = axis.low.value_or(data.low), high = axis.high.value_or(data.high);
  // A single value, or data beyond the given limit: adds room on the open sides.
  const double least = kNarrowest * std::max(std::abs(low), std::abs(high));
  if (!(high - low > least)) {
    const double room =
        low == 0.0 && high == 0.0 ? 1.0 : 0.1 * std::max(std::abs(low), std::abs(high));
    if (!axis.high) high = std::max(high, low) + room;
    if (!axis.low) low = std::min(low, axis.high.value_or(low)) - room;
  }
  const double room = kRoom * (high - low);
  if (!axis.low) low = data.low >= 0.0 && low >= 0.0 ? std::max(0.0, low - room) : low - room;
  if (!axis.high) high = data.high <= 0.0 && high <= 0.0 ? std::min(0.0, high + room) : high + room;
  return {AxisScale::linear, low, high};
}

AxisRange log_range(const PlotAxis& axis, Extent data) {
  double low = axis.low.value_or(data.low), high = axis.high.value_or(data.high);
  if (!(high > low * (1.0 + kNarrowest))) {
    if (!axis.high) high = 1.5 * std::max(high, low);
    if (!axis.low) low = std::min(low, axis.high.value_or(low)) / 1.5;
  }
  const double room = std::pow(high / low, kRoom);
  return {AxisScale::log, axis.low ? low : low / room, axis.high ? high : high * room};
}

AxisRange range(const PlotAxis& axis, const std::string& name, const Extent& data) {
  check_limits(axis, name);
  if (data.low > data.high && !(axis.low && axis.high)) {
    throw UsageError(
        "plot: expected at least one point, or both limits of both axes, found neither");
  }
  return axis.scale == AxisScale::log ? log_range(axis, data) : linear_range(axis, data);
}

}  // namespace

double AxisRange::share(double value) const {
  if (scale == AxisScale::linear) return (value - low) / (high - low);
  return std::log(value / low) / std::log(high / low);
}

AxisRange x_range(const Plot& plot) {
  Extent data;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& point : series.points) data.add(point.x);
  }
  for (const PlotNote& note : plot.notes) data.add(note.x);
  return range(plot.x, "x", data);
}

AxisRange y_range(const Plot& plot) {
  Extent data;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& point : series.points) {
      data.add(point.y);
      if (point.y_high) data.add(*point.y_high);
      if (point.y_low && (plot.y.scale == AxisScale::linear || *point.y_low >= 1.0 / kLargest)) {
        data.add(*point.y_low);
      }
    }
  }
  for (const PlotNote& note : plot.notes) data.add(note.y);
  return range(plot.y, "y", data);
}

void check_values(const Plot& plot) {
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const PlotSeries& series = plot.series[s];
    for (std::size_t p = 0; p < series.points.size(); ++p) {
      const PlotPoint& point = series.points[p];
      const std::string where = "plot: series[" + std::to_string(s) + "] '" + series.name +
                                "', point " + std::to_string(p) + ": ";
      check(point.x, plot.x.scale, where + "x");
      check(point.y, plot.y.scale, where + "y");
      if (point.y_low) check(*point.y_low, AxisScale::linear, where + "lower end of the bar");
      if (point.y_high) check(*point.y_high, plot.y.scale, where + "upper end of the bar");
    }
  }
  for (std::size_t n = 0; n < plot.notes.size(); ++n) {
    const std::string where = "plot: notes[" + std::to_string(n) + "]: ";
    check(plot.notes[n].x, plot.x.scale, where + "x");
    check(plot.notes[n].y, plot.y.scale, where + "y");
  }
}

namespace {

constexpr double kTitleSize = 1.25;
/// Least fraction of the picture's height for the data: long titles move the frame's lower end down instead.
constexpr double kLeastArea = 0.5;
/// Distance between a tick and its label.
constexpr double kTickGap = 0.35;

double widest_label(const std::vector<Tick>& ticks, double size_px) {
  double width = 0.0;
  for (const Tick& tick : ticks) width = std::max(width, text_width_px(tick.label, size_px));
  return width;
}

/// Adds title and subtitle from the top; returns y (pixels) below them.
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

/// As many labelled ticks as fit without touching. `extent_px(label)` is a label's extent along the axis of
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
  // Labels centred under the outer ticks may reach beyond the picture. Moving the area's edges moves the ticks by
  // less, and may leave room for fewer: later rounds correct this.
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
