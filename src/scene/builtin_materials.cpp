// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/scene/material.h"

namespace sarnerf {
namespace {

Material opaque(const char* name, double gamma0, double exponent) {
  Material material;
  material.name = name;
  material.gamma0 = gamma0;
  material.exponent = exponent;
  return material;
}

Material translucent(const char* name, double extinction_per_m, double scattering_per_m) {
  Material material;
  material.name = name;
  material.opaque = false;
  material.extinction_per_m = material.extinction_back_per_m = extinction_per_m;
  material.scattering_per_m = scattering_per_m;
  return material;
}

}  // namespace

const std::vector<Material>& builtin_materials() {
  // Round nominal values at X band. Each line is explained, with its source, in docs/materials.md.
  static const std::vector<Material> materials = {
      opaque("default", 1.0, 1.0),     opaque("asphalt", 0.04, 2.0),
      opaque("brick", 0.3, 1.5),       opaque("concrete", 0.2, 1.5),
      opaque("glass", 0.1, 6.0),       opaque("grass", 0.15, 0.5),
      opaque("gravel", 0.1, 1.0),      opaque("metal", 2.0, 3.0),
      opaque("roof", 0.2, 1.0),        opaque("snow", 0.12, 0.5),
      opaque("soil", 0.15, 1.0),       opaque("water", 0.02, 6.0),
      opaque("wood", 0.15, 1.0),       translucent("canopy", 0.2, 0.05),
      translucent("hedge", 0.5, 0.12),
  };
  return materials;
}

}  // namespace sarnerf
