// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <string>
#include <vector>

namespace sarnerf::app {

/// One `name = value` of a file.
struct FlatItem {
  std::string name;
  std::vector<std::string> values;  ///< one, or those of an array; quotes removed
  int line = 0;                     ///< from 1
};

/// Reads a TOML file without sections; `file` goes into messages. Throws InputError with file and line for
/// whatever TOML does not allow, for sections, dates and lists of lists, and for names of thousands of parts.
std::vector<FlatItem> read_flat_toml(std::istream& input, const std::string& file);

}  // namespace sarnerf::app
