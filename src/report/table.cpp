// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/table.h"

#include <algorithm>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// A cell's text as Markdown keeps it in its cell.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out;
}

/// Characters, not bytes: columns line up with × and ° in them.
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

  // The rule below the headings needs three characters a column.
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

}  // namespace sarnerf
