// SPDX-License-Identifier: Apache-2.0
#include "csv_table.h"

#include <cmath>

#include "fuzz_target.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    const CsvTable table(text_of(data, size), kName);
    for (std::size_t row = 0; row < table.n_rows(); ++row) {
      require(table.has("file") || table.text(row, "file").empty(), "what is not there is empty");
      if (const auto number = table.number(row, "azimuth_deg"))
        require(std::isfinite(*number), "numbers are finite");
    }
  });
}
