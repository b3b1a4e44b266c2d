// SPDX-License-Identifier: Apache-2.0
#include "mesh_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return sarnerf::fuzz::read_mesh_bytes(sarnerf::read_obj, data, size);
}
