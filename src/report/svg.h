// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sarnerf {

/// A position in the picture (pixels), y downwards.
struct Spot {
  double x = 0.0, y = 0.0;
};

/// A piece of a straight line (pixels).
struct Stroke {
  Spot from, to;
};

/// An upright rectangle (pixels).
struct Rect {
  double x0 = 0.0, y0 = 0.0, x1 = 0.0, y1 = 0.0;

  double width() const { return x1 - x0; }
  double height() const { return y1 - y0; }
  Rect grown(double by) const { return {x0 - by, y0 - by, x1 + by, y1 + by}; }
  bool holds(const Rect& r) const { return x0 <= r.x0 && r.x1 <= x1 && y0 <= r.y0 && r.y1 <= y1; }
  bool holds(Spot p) const { return x0 <= p.x && p.x <= x1 && y0 <= p.y && p.y <= y1; }
};

inline bool overlap(const Rect& a, const Rect& b) {
  return a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1;
}

/// Clips a stroke to the rectangle (Liang and Barsky); false when no part of it lies within.
inline bool clip(Stroke& stroke, const Rect& within) {
  const Spot from = stroke.from;
  const double dx = stroke.to.x - from.x, dy = stroke.to.y - from.y;
  double enters = 0.0, leaves = 1.0;
  const auto side = [&](double towards, double distance) {
    if (towards == 0.0) return distance >= 0.0;
    const double t = distance / towards;
    if (towards < 0.0) {
      enters = std::max(enters, t);
    } else {
      leaves = std::min(leaves, t);
    }
    return enters <= leaves;
  };
  if (!side(-dx, from.x - within.x0) || !side(dx, within.x1 - from.x) ||
      !side(-dy, from.y - within.y0) || !side(dy, within.y1 - from.y)) {
    return false;
  }
  stroke.to = {from.x + leaves * dx, from.y + leaves * dy};
  stroke.from = {from.x + enters * dx, from.y + enters * dy};
  return true;
}

inline bool crosses(Stroke stroke, const Rect& rect) { return clip(stroke, rect); }

/// Heights of a line of text as fractions of its size: above and below the baseline, between baselines,
/// and of capitals and digits, whose middle is used to centre a line.
inline constexpr double kAscent = 0.80;
inline constexpr double kDescent = 0.24;
inline constexpr double kLineHeight = 1.3;
inline constexpr double kCapHeight = 0.73;

/// The text as valid UTF-8 of characters that XML allows. Other characters become U+FFFD, white space a space.
std::string clean_text(std::string_view text);

/// Upper bound of the width (pixels) of a clean text of ordinary characters at `size_px` in DejaVu Sans, the
/// widest of the fonts that plots name. Exact for ASCII in regular weight, except for kerning.
double text_width_px(std::string_view clean, double size_px, bool bold = false);

/// Breaks a clean text into lines of at most `width_px`, at spaces and, if a single word is too long, within
/// it. At most `max_lines`; the last ends in "…" if text was left out. No lines for an empty text.
std::vector<std::string> wrap_text(std::string_view clean, double size_px, double width_px,
                                   std::size_t max_lines, bool bold = false);

/// Which part of a line of text lies at its spot.
enum class Anchor { start, middle, end };

/// One line of text: its baseline runs through `at`, upwards when `upwards`.
struct PlacedText {
  std::string text;  ///< clean (see clean_text()), not yet escaped
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

/// Replaces the markup characters of XML by entities.
std::string escaped(std::string_view text);

/// Writes an SVG document piece by piece.
class SvgWriter {
 public:
  SvgWriter(double width_px, double height_px, std::string_view label);

  void rect(const Rect& rect, std::string_view fill, std::string_view stroke = "none",
            double opacity = 1.0);
  /// `path` is in SVG's path language; `paint` holds further attributes.
  void path(std::string_view path, std::string_view paint);
  void text(const PlacedText& text);

  /// A group with a name that a reader of the source, or a style sheet, can find.
  void begin_group(std::string_view name);
  void end_group();

  /// Closes the document and returns it.
  std::string finish();

 private:
  void attribute(std::string_view name, std::string_view value);

  std::string out_;
};

/// "M x y L x y", the stroke as a path.
std::string path_of(const Stroke& stroke);

/// Base64 text of the bytes: four characters for three bytes, of letters, digits, + and /, padded with = (RFC 4648, section 4).
std::string base64(std::span<const std::byte> bytes);

}  // namespace sarnerf
