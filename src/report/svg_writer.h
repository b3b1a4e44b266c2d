// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "rect.h"

namespace sarnerf {

/// Where a text lies relative to its spot.
enum class Anchor { start, middle, end };

/// One line of text: its baseline runs through `at`, upwards when `upwards`.
struct PlacedText {
  std::string text;  ///< clean (see text_metrics.h), not yet escaped
  Spot at;
  double size_px = 16.0;
  Anchor anchor = Anchor::start;
  std::string_view colour{};
  bool bold = false;
  bool upwards = false;
};

/// The rectangle that holds the text in any font not wider than DejaVu Sans.
Rect bounds(const PlacedText& text);

/// A number as SVG text: hundredths of a pixel, no trailing zeros, no minus before zero.
std::string number(double value);

/// Markup characters of XML replaced by entities.
std::string escaped(std::string_view text);

/// Writes an SVG document piece by piece.
class SvgWriter {
 public:
  SvgWriter(double width_px, double height_px, std::string_view label);

  void rect(const Rect& rect, std::string_view fill, std::string_view stroke = "none",
            double opacity = 1.0);
  /// `path` in SVG's path language, `paint` further attributes.
  void path(std::string_view path, std::string_view paint);
  void text(const PlacedText& text);

  /// A group with a name that a reader of the source, or a style sheet, can find.
  void begin_group(std::string_view name);
  void end_group();

  /// Closes the document and hands it over.
  std::string finish();

 private:
  void attribute(std::string_view name, std::string_view value);

  std::string out_;
};

/// "M x y L x y", the stroke as a path.
std::string path_of(const Stroke& stroke);

}  // namespace sarnerf
