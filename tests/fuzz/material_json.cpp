// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "fuzz_target.h"
#include "sarnerf/scene/scene.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

namespace {

bool is_amount(double value) { return value >= 0.0 && std::isfinite(value); }

void require_meaning(const Material& material) {
  require(!material.name.empty(), "materials have names");
  for (const double value : {material.gamma0, material.exponent, material.extinction_per_m,
                             material.extinction_back_per_m, material.scattering_per_m}) {
    require(is_amount(value), "figures of materials are finite and not below 0");
  }
  for (const double x : {0.0, -0.3, 1e3, 1e12}) {
    const double factor = material.texture.factor({x, 0.7 * x, -x});
    require(factor >= 0.0 && factor <= 2.0, "textures keep between 0 and 2");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    MaterialLibrary library;
    for (const std::string& name : library.add_text(text_of(data, size), kName)) {
      require_meaning(library.require(name, kName));
    }
  });
}
