// SPDX-License-Identifier: Apache-2.0
#include "text_metrics.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace sarnerf {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";     // …

/// The widest ratio of bold to regular among the letters (that of i and l).
constexpr double kBoldWidening = 1.24;

/// Widths below are in the units of the font, so that they are exact.
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

/// Appends "…", taking away characters from the end until the line fits.
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

}  // namespace sarnerf
