// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

Scene scene_around(const Volume& volume, const std::filesystem::path& file, const LoadOptions& options) {
  Scene scene;
  scene.box = volume.box_m;
  scene.report.files.push_back(file);
  if (!options.ground_material || *options.ground_material == "none") return scene;
  MaterialLibrary materials;
  if (!options.materials_file.empty()) {
    materials.add_file(options.materials_file);
    scene.report.files.push_back(options.materials_file);
  }
  scene.materials.push_back(materials.require(*options.ground_material, "--ground"));
  const double lowest_m = scene.box.empty() ? 0.0 : scene.box.min.y;
  scene.ground = Ground{0, options.ground_height_m.value_or(lowest_m)};
  return scene;
}

}  // namespace sarnerf
