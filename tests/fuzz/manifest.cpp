// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/manifest.h"

#include "fuzz_target.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    const Dataset dataset = parse_manifest(text_of(data, size), kName);
    require(!dataset.views.empty(), "a dataset has views");
    std::string text;
    try {
      text = manifest_text(dataset);
    } catch (const UsageError& error) {
      std::fprintf(stderr, "%s\n", error.what());
      require(false, "what was read can be written");
    }
    require(manifest_text(parse_manifest(text, kName)) == text, "what was written reads back the same");
  });
}
