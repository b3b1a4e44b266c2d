// SPDX-License-Identifier: Apache-2.0
#include "view.h"

#include <filesystem>

#include "generated.h"
#include "sarnerf/core/units.h"
#include "sarnerf/render/framing.h"

namespace sarnerf::bench {

std::vector<NamedScene> load_scenes(const StudyOptions& options) {
  std::vector<NamedScene> scenes;
  for (const std::string& file : options.scene_files) {
    scenes.push_back({std::filesystem::path(file).stem().string(), load_scene(file, options.load)});
  }
  if (scenes.empty()) {
    scenes.push_back({"sphere-1k", bumpy_sphere(1'000, 8.0)});
    scenes.push_back({"sphere-100k", bumpy_sphere(100'000, 8.0)});
  }
  return scenes;
}

Acquisition standard_view(const Scene& scene, const StudyOptions& options) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(options.azimuth_deg);
  a.incidence_rad = rad_from_deg(options.pitch_deg);
  a.slant_range_m = slant_range_from_altitude_m(10'000.0, a.incidence_rad);
  a.aim_m = default_aim_m(scene);
  a.n_azimuth = a.n_range = options.size;
  a.azimuth_spacing_m = a.range_spacing_m = options.spacing_m;
  return a;
}

}  // namespace sarnerf::bench
