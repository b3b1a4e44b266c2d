// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/phoenix.h"

#include <algorithm>

#include "fuzz_target.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    const PhoenixChip chip = parse_phoenix(std::as_bytes(std::span(data, size)), kName);
    const auto pixels = chip.magnitude.pixels();
    require(!pixels.empty() && pixels.size() == chip.phase_rad.pixels().size(),
            "a chip has pixels, and as many phases");
    for (const float pixel : pixels)
      require(pixel >= 0.0f, "magnitudes are numbers, and not negative");
    require(chip_of(chip, 4500.0).view.slant_range_m > 0.0, "a chip has a range");
    const PhoenixChip again = parse_phoenix(encode_phoenix(chip), kName);
    require(std::equal(pixels.begin(), pixels.end(), again.magnitude.pixels().begin()) &&
                again.target_azimuth_deg == chip.target_azimuth_deg,
            "what was written reads back the same");
  });
}
