// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace sarnerf {

enum class AxisScale { linear, log };

/// One axis of a plot. Limits that are not given follow the data, with a little room beyond it.
struct PlotAxis {
  std::string label;  ///< quantity and unit: "error (%)"
  AxisScale scale = AxisScale::linear;
  std::optional<double> low{}, high{};
};

/// A point in the units of the axes, and the range over which y scatters.
struct PlotPoint {
  double x = 0.0, y = 0.0;
  std::optional<double> y_low{}, y_high{};  ///< ends of a vertical bar
};

enum class PlotMarker {
  automatic,  ///< the next shape; none for a line through more than 60 points
  none,
  ring,  ///< an open circle around the point, to mark points of other series without hiding them
  circle,
  square,
  triangle,
  diamond,
  triangle_down,
  pentagon,
  plus,
  cross,
};

enum class PlotLine { none, solid, dashed };

/// Points that belong together. Colours are those of Okabe and Ito, which colour-blind readers can
/// distinguish; the shapes differ as well, so that a grey print can be read.
struct PlotSeries {
  std::string name;               ///< in the legend; empty: not in the legend
  std::vector<PlotPoint> points;  ///< joined in this order
  PlotMarker marker = PlotMarker::automatic;
  PlotLine line = PlotLine::solid;
  bool emphasised = false;      ///< black and wider: the series that the plot is about
  std::optional<int> colour{};  ///< number in the palette; empty: the next one
};

/// A few words beside a point.
struct PlotNote {
  double x = 0.0, y = 0.0;
  std::string text;
};

/// A plot to draw. Lengths are CSS pixels of the picture at its own size. With the defaults the smallest
/// text has 12 pixels on a page that shows the picture 600 pixels wide.
struct Plot {
  std::string title, subtitle;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  std::vector<PlotNote> notes;
  double width_px = 800.0;
  double height_px = 540.0;  ///< grows when a long legend has to stand below the plot
  double text_px = 16.0;     ///< at least 12
  bool legend_beside = true;  ///< whether the legend may stand to the right, at the cost of the plot's width
};

/// The plot as an SVG document with a white background of its own, the same bytes for the same plot.
///
/// Placement: the legend goes into the first corner of the plot where it covers nothing; else to the right, if
/// that is allowed and it is no taller than the plot; else below. A note goes where it covers least, with a line
/// to its point when it is not beside it. A note for which every position would cover other text is left out,
/// and a line below the plot reports how many were. Long names break into up to three lines, the last ending
/// in "…" if text is left out. No two texts overlap in any font that is not wider than DejaVu Sans.
///
/// Text is UTF-8. Bytes that are not, and characters that XML forbids, become U+FFFD. Points beyond the limits
/// are not drawn, lines are cut there. A bar's lower end that is not positive on a logarithmic axis reaches
/// down to the frame.
///
/// Throws UsageError, naming the series and the point, for values that are not finite or of a magnitude
/// beyond 1e100, values that are not positive on a logarithmic axis (or below 1e-100), limits in the wrong
/// order or too close together, a size without room for the text, and a plot that has neither points nor
/// limits. O(points), times the number of notes.
std::string svg(const Plot& plot);

/// The bytes of an opaque 8-bit RGB PNG of an SVG document on white, `scale` pixels for each of the
/// document's own. The same bytes for the same document, fonts and version of librsvg; nothing outside of
/// the document is loaded. Throws UsageError for a scale that is not positive or gives a picture of more
/// than 32,767 pixels a side or 256 million pixels, InputError for text that is not an SVG document or has no
/// size in pixels, and Error when it cannot be drawn. About 4 bytes a pixel.
std::vector<std::byte> png_of_svg(const std::string& svg, double scale = 1.0);

}  // namespace sarnerf
