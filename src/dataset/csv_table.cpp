// SPDX-License-Identifier: Apache-2.0
#include "csv_table.h"

#include <csv.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <new>

#include "sarnerf/core/error.h"
#include "sarnerf/core/input_text.h"

namespace sarnerf {
namespace {

using Rows = std::vector<std::vector<std::string>>;

/// libcsv calls these from C: nothing may be thrown through it.
struct Collector {
  Rows rows{1};
  bool out_of_memory = false;
};

void take_field(void* field, std::size_t size, void* target) noexcept {
  auto& collector = *static_cast<Collector*>(target);
  try {
    collector.rows.back().emplace_back(static_cast<const char*>(field), size);
  } catch (const std::bad_alloc&) {
    collector.out_of_memory = true;
  }
}

void end_row(int, void* target) noexcept {
  auto& collector = *static_cast<Collector*>(target);
  try {
    collector.rows.emplace_back();
  } catch (const std::bad_alloc&) {
    collector.out_of_memory = true;
  }
}

Rows parse(std::string_view text, const std::string& where) {
  csv_parser parser;
  if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI) != 0) throw std::bad_alloc();
  Collector collector;
  const bool whole = csv_parse(&parser, text.data(), text.size(), take_field, end_row,
                               &collector) == text.size() &&
                     csv_fini(&parser, take_field, end_row, &collector) == 0;
  const bool out_of_memory = collector.out_of_memory || csv_error(&parser) == CSV_ENOMEM;
  csv_free(&parser);
  if (out_of_memory) throw std::bad_alloc();
  if (!whole)
    throw InputError(where + ": row " + std::to_string(collector.rows.size() - 1) +
                     ": a quote does not close, or stands inside of an unquoted field; quotes in "
                     "fields are doubled");
  if (collector.rows.back().empty()) collector.rows.pop_back();
  return std::move(collector.rows);
}

}  // namespace

CsvTable::CsvTable(std::string_view text, std::string where) : where_(std::move(where)) {
  rows_ = parse(without_byte_order_mark(text, where_), where_);
  if (rows_.empty()) fail("the table is empty; expected a line with the names of its columns");
  names_ = std::move(rows_.front());
  rows_.erase(rows_.begin());
  for (std::size_t n = 0; n < names_.size(); ++n)
    if (!names_[n].empty() &&
        std::find(names_.begin(), names_.begin() + n, names_[n]) != names_.begin() + n)
      fail("the column " + in_quotes(names_[n]) + " stands twice");
  for (std::size_t row = 0; row < rows_.size(); ++row)
    if (rows_[row].size() != names_.size())
      fail(row, "expected " + std::to_string(names_.size()) +
                    " fields, one for each column, found " + std::to_string(rows_[row].size()));
}

std::optional<std::size_t> CsvTable::place(std::string_view column) const {
  const auto found = std::find(names_.begin(), names_.end(), column);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

bool CsvTable::has(std::string_view column) const { return place(column).has_value(); }

const std::string& CsvTable::text(std::size_t row, std::string_view column) const {
  static const std::string kNothing;
  const auto n = place(column);
  return n ? rows_[row][*n] : kNothing;
}

std::optional<double> CsvTable::number(std::size_t row, std::string_view column) const {
  const std::string& field = text(row, column);
  if (field.empty()) return std::nullopt;
  double value = 0.0;
  const auto [rest, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || rest != field.data() + field.size() || !std::isfinite(value))
    fail(row, std::string(column) + ": expected a number, found " + in_quotes(field));
  return value;
}

void CsvTable::fail(const std::string& what) const { throw InputError(where_ + ": " + what); }

void CsvTable::fail(std::size_t row, const std::string& what) const {
  fail("row " + std::to_string(row + 1) + ": " + what);
}

}  // namespace sarnerf
