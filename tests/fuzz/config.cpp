// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <sstream>
#include <string>

#include "values.h"
#include "fuzz_target.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    std::istringstream input{std::string(text_of(data, size))};
    const auto n_lines = std::count(data, data + size, '\n') + 1;
    for (const app::FlatItem& item : app::read_flat_toml(input, kName)) {
      require(!item.values.empty(), "names have values");
      require(item.line >= 1 && item.line <= n_lines, "lines are those of the file");
    }
  });
}
