// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_index.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>

#include "fuzz_target.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // libmatio opens files by name: this one lies in memory.
  const int file = ::memfd_create("sample", 0);
  require(file >= 0 && ::write(file, data, size) == static_cast<ssize_t>(size),
          "there is memory for the input");
  const int result = read_or_refuse([&] {
    const Chip chip = read_sample("/proc/self/fd/" + std::to_string(file), 4500.0);
    require(!chip.image.pixels().empty(), "a chip has pixels");
    for (const float pixel : chip.image.pixels())
      require(std::isfinite(pixel) && pixel >= 0.0f, "magnitudes are finite and not negative");
    require(chip.view.incidence_deg > 0.0 && chip.view.incidence_deg < 90.0,
            "a chip has an incidence");
  });
  ::close(file);
  return result;
}
