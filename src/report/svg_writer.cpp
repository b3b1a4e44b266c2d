// SPDX-License-Identifier: Apache-2.0
#include "svg_writer.h"

#include <cmath>
#include <utility>

#include "text_metrics.h"

namespace sarnerf {

Rect bounds(const PlacedText& text) {
  const double width = text_width_px(text.text, text.size_px, text.bold);
  const double before = text.anchor == Anchor::start    ? 0.0
                        : text.anchor == Anchor::middle ? 0.5 * width
                                                        : width;
  const double above = kAscent * text.size_px, below = kDescent * text.size_px;
  const auto [x, y] = text.at;
  if (text.upwards) return {x - above, y + before - width, x + below, y + before};
  return {x - before, y - above, x - before + width, y + below};
}

std::string number(double value) {
  const long long hundredths = std::llround(value * 100.0);
  std::string text = std::to_string(std::llabs(hundredths) / 100);
  if (const long long rest = std::llabs(hundredths) % 100; rest != 0) {
    text += '.';
    text += char('0' + rest / 10);
    if (rest % 10 != 0) text += char('0' + rest % 10);
  }
  return (hundredths < 0 ? "-" : "") + text;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&apos;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string path_of(const Stroke& stroke) {
  return "M" + number(stroke.from.x) + ' ' + number(stroke.from.y) + 'L' + number(stroke.to.x) +
         ' ' + number(stroke.to.y);
}

SvgWriter::SvgWriter(double width_px, double height_px, std::string_view label) {
  const std::string width = number(width_px), height = number(height_px);
  out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width + "\" height=\"" + height +
         "\" viewBox=\"0 0 " + width + ' ' + height + "\" role=\"img\" aria-label=\"" +
         escaped(label) + "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\">\n";
}

void SvgWriter::rect(const Rect& rect, std::string_view fill, std::string_view stroke,
                     double opacity) {
  out_ += "<rect x=\"" + number(rect.x0) + "\" y=\"" + number(rect.y0) + "\" width=\"" +
          number(rect.width()) + "\" height=\"" + number(rect.height()) + '"';
  attribute("fill", fill);
  if (opacity < 1.0) attribute("fill-opacity", number(opacity));
  if (stroke != "none") attribute("stroke", stroke);
  out_ += "/>\n";
}

void SvgWriter::path(std::string_view path, std::string_view paint) {
  if (path.empty()) return;
  out_ += "<path";
  attribute("d", path);
  out_ += ' ';
  out_ += paint;
  out_ += "/>\n";
}

void SvgWriter::text(const PlacedText& text) {
  const std::string x = number(text.at.x), y = number(text.at.y);
  out_ += "<text";
  attribute("x", x);
  attribute("y", y);
  attribute("font-size", number(text.size_px));
  if (text.anchor == Anchor::middle) attribute("text-anchor", "middle");
  if (text.anchor == Anchor::end) attribute("text-anchor", "end");
  if (text.bold) attribute("font-weight", "bold");
  if (text.upwards) attribute("transform", "rotate(-90 " + x + ' ' + y + ')');
  if (!text.colour.empty()) attribute("fill", text.colour);
  out_ += '>' + escaped(text.text) + "</text>\n";
}

void SvgWriter::begin_group(std::string_view name) {
  out_ += "<g";
  attribute("class", name);
  out_ += ">\n";
}

void SvgWriter::attribute(std::string_view name, std::string_view value) {
  out_ += ' ';
  out_ += name;
  out_ += "=\"";
  out_ += value;
  out_ += '"';
}

void SvgWriter::end_group() { out_ += "</g>\n"; }

std::string SvgWriter::finish() {
  out_ += "</svg>\n";
  return std::move(out_);
}

}  // namespace sarnerf
