// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace sarnerf {

enum class Align { left, right };

struct TableColumn {
  std::string heading;
  Align align = Align::left;
};

/// A Markdown table, padded so that it reads well as plain text too. Bars and line breaks within cells are
/// escaped. Throws UsageError without columns and for a row whose number of cells is not theirs.
std::string markdown_table(const std::vector<TableColumn>& columns,
                           const std::vector<std::vector<std::string>>& rows);

}  // namespace sarnerf
