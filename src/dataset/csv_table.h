// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sarnerf {

/// A table with named columns. Every error is an InputError "where: row N: …"; rows are counted from 1, after the line of
/// names.
class CsvTable {
 public:
  /// Throws InputError for quotes that do not close and rows that have more or fewer fields than there are names.
  CsvTable(std::string_view text, std::string where);

  std::size_t n_rows() const { return rows_.size(); }
  bool has(std::string_view column) const;

  /// Empty where the table has no such column.
  const std::string& text(std::size_t row, std::string_view column) const;
  std::optional<double> number(std::size_t row, std::string_view column) const;

  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail(std::size_t row, const std::string& what) const;

 private:
  std::optional<std::size_t> place(std::string_view column) const;

  std::string where_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace sarnerf
