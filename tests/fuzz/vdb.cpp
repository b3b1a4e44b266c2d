// SPDX-License-Identifier: Apache-2.0
#include "vdb/vdb_layouts.h"

#include <cmath>

#include "fuzz_target.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/scene/vdb_scene.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

namespace {

void require_sound(const Volume& volume) {
  const auto values = volume.grid.view().values;
  const int n_channels = volume.channels.count();
  require(values.size() == volume.grid.topology().n_bricks() * std::size_t{kBrickVoxels} *
                               static_cast<std::size_t>(n_channels),
          "each brick has its values");
  for (std::size_t n = 0; n < values.size(); ++n) {
    require(std::isfinite(values[n]), "values are finite");
    const bool extinction = n % static_cast<std::size_t>(n_channels) == 0;
    require(!extinction || values[n] >= 0.0f, "extinction is not below 0");
  }
  require((volume.n_occupied_voxels == 0) == volume.support_m.empty(), "the support holds what is occupied");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // One thread: an input takes the same way each time.
  static const ThreadLimit one_thread(1);
  return read_or_refuse([&] {
    constexpr std::uint64_t kMostBytes = 64'000'000;
    VdbReadOptions options;
    options.max_memory_bytes = kMostBytes;
    const VdbScene scene = read_vdb_bytes(text_of(data, size), kName, options);
    (void)scene.summary();
    require_sound(to_volume(scene, kMostBytes));
  });
}
