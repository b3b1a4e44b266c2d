// SPDX-License-Identifier: Apache-2.0
#include "legend.h"

#include <algorithm>
#include <utility>

#include "series_style.h"
#include "text_metrics.h"

namespace sarnerf {
namespace {

// Shares of the text size.
constexpr double kPadding = 0.5;
constexpr double kSample = 2.0;      // length of the piece of line
constexpr double kSampleGap = 0.55;  // between it and the name
constexpr double kColumnGap = 1.6;
constexpr double kEntryHeight = 1.45;  // of one line; further lines add kLineHeight
constexpr std::size_t kMostLines = 3;

struct Name {
  std::size_t series = 0;
  std::vector<std::string> lines;
  double height_px = 0.0;
};

}  // namespace

Legend legend_of(const Plot& plot, double width_px, std::size_t max_columns) {
  const double em = plot.text_px, sample_px = (kSample + kSampleGap) * em;
  std::vector<Name> names;
  double widest = 0.0;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    Name name{s, wrap_text(clean_text(plot.series[s].name), em,
                           width_px - sample_px - 2.0 * kPadding * em, kMostLines)};
    if (name.lines.empty()) continue;
    for (const std::string& line : name.lines) widest = std::max(widest, text_width_px(line, em));
    name.height_px = (kEntryHeight + double(name.lines.size() - 1) * kLineHeight) * em;
    names.push_back(std::move(name));
  }
  Legend legend;
  if (names.empty()) return legend;

  const double column_px = sample_px + widest, step_px = column_px + kColumnGap * em;
  const auto fitting =
      std::size_t(std::max(1.0, (width_px - 2.0 * kPadding * em + kColumnGap * em) / step_px));
  const std::size_t columns = std::min({fitting, max_columns, names.size()});
  const std::size_t rows = (names.size() + columns - 1) / columns;

  double x = kPadding * em, y = kPadding * em;
  for (std::size_t n = 0; n < names.size(); ++n) {
    if (n > 0 && n % rows == 0) {
      x += step_px;
      y = kPadding * em;
    }
    const double middle = y + 0.5 * kEntryHeight * em;
    LegendEntry entry{names[n].series, {{x, middle}, {x + kSample * em, middle}}, {}};
    double baseline = middle + 0.5 * kCapHeight * em;
    for (std::string& line : names[n].lines) {
      entry.lines.push_back({std::move(line), {x + sample_px, baseline}, em, Anchor::start, kInk});
      baseline += kLineHeight * em;
    }
    y += names[n].height_px;
    legend.entries.push_back(std::move(entry));
    legend.box.y1 = std::max(legend.box.y1, y + kPadding * em);
  }
  legend.box.x1 = x + column_px + kPadding * em;
  return legend;
}

Legend moved(Legend legend, Spot by) {
  const auto move = [&](Spot& spot) { spot = {spot.x + by.x, spot.y + by.y}; };
  legend.box = {legend.box.x0 + by.x, legend.box.y0 + by.y, legend.box.x1 + by.x,
                legend.box.y1 + by.y};
  for (LegendEntry& entry : legend.entries) {
    move(entry.sample.from);
    move(entry.sample.to);
    for (PlacedText& line : entry.lines) move(line.at);
  }
  return legend;
}

}  // namespace sarnerf
