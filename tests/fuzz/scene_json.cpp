// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "fuzz_target.h"
#include "readers/scene_file.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    // A folder that is not there: materials files named by the input are not found, whatever they are called.
    const SceneFile scene = parse_scene_file(text_of(data, size), kName, "no/such/folder");
    for (const MeshEntry& mesh : scene.meshes) {
      require(mesh.metres_per_unit > 0.0, "units are above 0");
      for (int n = 0; n < 16; ++n) {
        require(std::isfinite(mesh.world_from_object[n / 4][n % 4]), "placements are finite");
      }
    }
  });
}
