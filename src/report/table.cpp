// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/report/page.h"
#include "training_parts.h"

namespace sarnerf {

namespace {

/// A cell's text, with bars escaped and line breaks replaced, so that Markdown keeps it in its cell.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out;
}

/// Length in characters, not bytes, so that columns with × and ° line up.
std::size_t length(const std::string& text) {
  return std::size_t(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

}  // namespace

std::string markdown_table(const std::vector<TableColumn>& columns,
                           const std::vector<std::vector<std::string>>& rows) {
  if (columns.empty()) throw UsageError("table: expected at least one column, found none");
  std::vector<std::vector<std::string>> lines(1);
  for (const TableColumn& column : columns) lines[0].push_back(cell(column.heading));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (rows[r].size() != columns.size()) {
      throw UsageError("table: expected " + std::to_string(columns.size()) + " cells in row " +
                       std::to_string(r) + ", found " + std::to_string(rows[r].size()));
    }
    std::vector<std::string>& line = lines.emplace_back();
    for (const std::string& text : rows[r]) line.push_back(cell(text));
  }

  // The rule below the headings needs three characters in each column.
  std::vector<std::size_t> widths(columns.size(), 3);
  for (const auto& line : lines) {
    for (std::size_t c = 0; c < line.size(); ++c) widths[c] = std::max(widths[c], length(line[c]));
  }
  std::string text;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const std::string padding(widths[c] - length(lines[l][c]), ' ');
      const bool right = columns[c].align == Align::right;
      text += "| " + (right ? padding : "") + lines[l][c] + (right ? "" : padding) + ' ';
    }
    text += "|\n";
    if (l > 0) continue;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const bool right = columns[c].align == Align::right;
      text += '|' + std::string(widths[c] + 1, '-') + (right ? ":" : "-");
    }
    text += "|\n";
  }
  return text;
}

namespace {

/// Formats a number; the result is the same in every locale.
std::string written(double value, std::chars_format format, int digits) {
  std::array<char, 400> buffer;  // the largest double has 309 digits before the point
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format, digits).ptr;
  return {buffer.data(), end};
}

/// Replaces the hyphen by a minus sign as wide as a plus, and removes it before zero.
std::string with_minus(const std::string& text) {
  if (text[0] != '-') return text;
  const bool zero = text.find_first_not_of("-0.") == std::string::npos;
  return (zero ? "" : "−") + text.substr(1);
}

std::string two_digits(long number) { return (number < 10 ? "0" : "") + std::to_string(number); }

}  // namespace

std::string decimal(double value, int digits) {
  if (std::isnan(value)) return "–";
  if (std::isinf(value)) return value > 0.0 ? "∞" : "−∞";
  return with_minus(written(value, std::chars_format::fixed, digits));
}

std::string decimal(const std::optional<double>& value, int digits) {
  return value ? decimal(*value, digits) : "–";
}

std::string degrees(double angle_deg) {
  std::string text = decimal(angle_deg, 2);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text + "°";
}

std::string signed_decimal(double value, int digits) {
  const std::string text = decimal(value, digits);
  const bool zero = text.find_first_not_of("0.") == std::string::npos;
  return value > 0.0 && !zero ? "+" + text : text;
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return decimal(value, 0);
  return with_minus(written(value, std::chars_format::general, digits));
}

std::string duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0.0) return decimal(seconds, 0) + " s";
  if (seconds < 9.995) return decimal(seconds, 2) + " s";
  if (seconds < 59.95) return decimal(seconds, 1) + " s";
  if (seconds >= 1e15) return significant(seconds, 3) + " s";
  const long whole = std::lround(seconds);
  if (whole < 3600) return std::to_string(whole / 60) + " min " + two_digits(whole % 60) + " s";
  const long minutes = std::lround(seconds / 60.0);
  return std::to_string(minutes / 60) + " h " + two_digits(minutes % 60) + " min";
}

std::string count(std::size_t number, const std::string& thing) {
  return std::to_string(number) + ' ' + thing + (number == 1 ? "" : "s");
}

}  // namespace sarnerf
