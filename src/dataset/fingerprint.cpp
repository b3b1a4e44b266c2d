// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/fingerprint.h"

#include <span>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/core/sha256.h"

namespace sarnerf {

std::string dataset_fingerprint(const std::filesystem::path& folder, const Dataset& dataset,
                                const Monitor& monitor) {
  std::vector<std::string> names{std::string(kManifestName)};
  for (const DatasetView& view : dataset.views) names.push_back(view.image);
  std::vector<std::string> digests(names.size());
  parallel_for(names.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      monitor.check();
      digests[n] = sha256_of_file(folder / names[n]);
    }
  });
  Sha256 all;
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::string line = digests[n] + "  " + names[n] + "\n";
    all.update(std::as_bytes(std::span(line)));
  }
  return all.hex_digest();
}

}  // namespace sarnerf
