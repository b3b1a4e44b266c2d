// SPDX-License-Identifier: Apache-2.0
#include "svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include <librsvg/rsvg.h>

#include "sarnerf/core/error.h"
#include "sarnerf/report/plot.h"

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

namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";     // …

/// The widest ratio of bold to regular among the letters (that of i and l).
constexpr double kBoldWidening = 1.24;

/// The widths below are exact, in units of the font.
constexpr double kUnitsPerEm = 2048.0;

/// Advance widths of DejaVu Sans, from the space to the tilde.
constexpr std::array<int, 95> kAsciiWidths{
    651,  821,  942,  1716, 1303, 1946, 1597, 563,  799,  799,  1024, 1716, 651,  739,  651,  690,
    1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 690,  690,  1716, 1716, 1716, 1087,
    2048, 1401, 1405, 1430, 1577, 1294, 1178, 1587, 1540, 604,  604,  1343, 1141, 1767, 1532, 1612,
    1235, 1612, 1423, 1300, 1251, 1499, 1401, 2025, 1403, 1251, 1403, 799,  690,  799,  1716, 1024,
    1024, 1255, 1300, 1126, 1300, 1260, 721,  1300, 1298, 569,  569,  1186, 569,  1995, 1298, 1253,
    1300, 1300, 842,  1067, 803,  1298, 1212, 1675, 1212, 1212, 1075, 1303, 690,  1303, 1716};

/// One code point and its length in bytes; length 0 when the bytes are not UTF-8.
struct CodePoint {
  std::uint32_t value = 0;
  std::size_t length = 0;
};

CodePoint code_point_at(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t n) {
    return std::uint32_t(static_cast<unsigned char>(text[n]));
  };
  const std::uint32_t lead = byte(at);
  if (lead < 0x80) return {lead, 1};
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || at + length > text.size()) return {};
  std::uint32_t value = lead & (0xFFu >> (length + 1));
  for (std::size_t n = 1; n < length; ++n) {
    if ((byte(at + n) & 0xC0) != 0x80) return {};
    value = value << 6 | (byte(at + n) & 0x3F);
  }
  constexpr std::array<std::uint32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = value >= 0xD800 && value <= 0xDFFF;
  if (value < kLeast[length] || value > 0x10FFFF || surrogate) return {};
  return {value, length};
}

int width_of(std::uint32_t c) {
  if (c >= 0x20 && c <= 0x7E) return kAsciiWidths[c - 0x20];
  switch (c) {
    case 0xB7:
      return 651;  // ·
    case 0xB0:
    case 0x2013:
      return 1024;  // ° –
    case 0xB5:
      return 1303;  // µ
    case 0xD7:
    case 0x2212:
      return 1716;  // × −
    case 0xB9:
    case 0xB2:
    case 0xB3:
      return 821;
    default:
      break;
  }
  if (c >= 0x2070 && c <= 0x209F) return 1082;  // superscripts and subscripts
  if (c >= 0x370 && c <= 0x3FF) return 1800;    // Greek
  return c < 0x2E80 ? 2250 : 2560;
}

/// Removes characters from the end until the line fits with "…" appended.
std::string shortened(std::string line, double size_px, double width_px, bool bold) {
  while (!line.empty() && text_width_px(line + std::string(kEllipsis), size_px, bold) > width_px) {
    while ((static_cast<unsigned char>(line.back()) & 0xC0) == 0x80) line.pop_back();
    line.pop_back();
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line + std::string(kEllipsis);
}

}  // namespace

std::string clean_text(std::string_view text) {
  std::string clean;
  for (std::size_t at = 0; at < text.size();) {
    const auto [value, length] = code_point_at(text, at);
    if (length == 0) {
      clean += kReplacement;
      ++at;
      continue;
    }
    if (value == '\t' || value == '\n' || value == '\r' || value == ' ') {
      clean += ' ';
    } else if (value < 0x20 || (value >= 0x7F && value < 0xA0) || value == 0xFFFE ||
               value == 0xFFFF) {
      clean += kReplacement;
    } else {
      clean += text.substr(at, length);
    }
    at += length;
  }
  return clean;
}

double text_width_px(std::string_view clean, double size_px, bool bold) {
  double units = 0.0;
  for (std::size_t at = 0; at < clean.size();) {
    const CodePoint c = code_point_at(clean, at);
    units += width_of(c.value);
    at += c.length == 0 ? 1 : c.length;
  }
  return units / kUnitsPerEm * size_px * (bold ? kBoldWidening : 1.0);
}

std::vector<std::string> wrap_text(std::string_view clean, double size_px, double width_px,
                                   std::size_t max_lines, bool bold) {
  const auto fits = [&](const std::string& line) {
    return text_width_px(line, size_px, bold) <= width_px;
  };
  std::vector<std::string> lines;
  std::string line;
  const auto finish_line = [&] {
    lines.push_back(line);
    line.clear();
  };
  for (std::size_t at = 0; at < clean.size() && lines.size() <= max_lines;) {
    if (clean[at] == ' ') {
      ++at;
      continue;
    }
    const std::size_t end = std::min(clean.find(' ', at), clean.size());
    const std::string word(clean.substr(at, end - at));
    at = end;
    if (line.empty() ? fits(word) : fits(line + ' ' + word)) {
      line += line.empty() ? word : ' ' + word;
      continue;
    }
    if (!line.empty()) finish_line();
    for (std::size_t n = 0; n < word.size() && lines.size() <= max_lines;) {
      const std::string character = word.substr(n, code_point_at(word, n).length);
      if (!line.empty() && !fits(line + character)) finish_line();
      line += character;
      n += character.size();
    }
  }
  if (!line.empty()) finish_line();
  if (lines.size() > max_lines) {
    lines.resize(max_lines);
    if (!lines.empty()) lines.back() = shortened(lines.back(), size_px, width_px, bold);
  }
  return lines;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    const std::size_t here = std::min<std::size_t>(3, bytes.size() - n);
    std::uint32_t bits = 0;
    for (std::size_t b = 0; b < 3; ++b) {
      bits = bits << 8 | (b < here ? std::to_integer<std::uint32_t>(bytes[n + b]) : 0u);
    }
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += digit <= here ? kDigits[bits >> (18 - 6 * digit) & 63u] : '=';
    }
  }
  return text;
}

namespace {

constexpr double kLargestSide = 32767.0;  // limit of a cairo surface
constexpr double kMostPixels = 256.0 * 1024.0 * 1024.0;

/// Owns the error that librsvg reports.
class RsvgError {
 public:
  ~RsvgError() { g_clear_error(&error_); }
  GError** out() { return &error_; }
  std::string message() const { return error_ != nullptr ? error_->message : "no reason given"; }

 private:
  GError* error_ = nullptr;
};

struct Release {
  void operator()(RsvgHandle* handle) const { g_object_unref(handle); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
template <class T>
using Owned = std::unique_ptr<T, Release>;

void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw Error(std::string("a plot could not be drawn: ") + cairo_status_to_string(status));
  }
}

/// Called from C: must not throw.
cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) noexcept try {
  auto& bytes = *static_cast<std::vector<std::byte>*>(closure);
  const auto* first = reinterpret_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), first, first + length);
  return CAIRO_STATUS_SUCCESS;
} catch (...) {
  return CAIRO_STATUS_NO_MEMORY;
}

}  // namespace

std::vector<std::byte> png_of_svg(const std::string& svg, double scale) {
  if (!(scale > 0.0 && std::isfinite(scale))) {
    throw UsageError("picture: expected a scale above zero, found " + std::to_string(scale));
  }
  RsvgError error;
  const Owned<RsvgHandle> handle(rsvg_handle_new_from_data(
      reinterpret_cast<const guint8*>(svg.data()), svg.size(), error.out()));
  if (!handle) throw InputError("picture: expected an SVG document: " + error.message());
  double width = 0.0, height = 0.0;
  if (!rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height) || !(width > 0.0) ||
      !(height > 0.0)) {
    throw InputError(
        "picture: expected an SVG document with a width and a height in pixels, found none");
  }
  width = std::ceil(width * scale);
  height = std::ceil(height * scale);
  if (!(width <= kLargestSide && height <= kLargestSide && width * height <= kMostPixels)) {
    throw UsageError(
        "picture: expected at most 32767 pixels a side and 256 million in all, found " +
        number(width) + " x " + number(height) + "; choose a smaller scale");
  }

  const Owned<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, int(width), int(height)));
  check(cairo_surface_status(surface.get()));
  const Owned<cairo_t> context(cairo_create(surface.get()));
  cairo_set_source_rgb(context.get(), 1.0, 1.0, 1.0);
  cairo_paint(context.get());
  const RsvgRectangle everywhere{0.0, 0.0, width, height};
  if (!rsvg_handle_render_document(handle.get(), context.get(), &everywhere, error.out())) {
    throw Error("a plot could not be drawn: " + error.message());
  }
  check(cairo_status(context.get()));

  std::vector<std::byte> png;
  check(cairo_surface_write_to_png_stream(surface.get(), append, &png));
  return png;
}

}  // namespace sarnerf
