// SPDX-License-Identifier: Apache-2.0
#include "unused_options.h"

#include <algorithm>

namespace sarnerf::app {
namespace {

/// Where an option matters, and why it does not elsewhere.
struct Rule {
  const char* option;
  bool matters;
  const char* why_not;
};

bool has_media(const Scene& scene) {
  return std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) { return !m.opaque; });
}

/// Whether anything refers to the reference plane: its height is no matter otherwise.
bool uses_reference_plane(const Job& job) {
  const Options& o = job.options;
  const bool in_layers = o.layers.has(Layer::mask) || o.layers.has(Layer::elevation);
  return job.scene->ground || in_layers || o.calibration != Calibration::beta0 || o.formation.nesz_db;
}

}  // namespace

std::vector<std::string> unused_options(const Job& job) {
  const Options& o = job.options;
  const Rule rules[] = {
      {"integrator", job.built.voxel || has_media(*job.scene),
       "all matter is opaque, and the surface engine integrates translucent matter only"},
      {"seed", o.formation.speckle(), "there is no speckle (--looks)"},
      {"voxel-size", job.built.voxel, "no voxels are made"},
      {"extinction-per-density", o.volume(), "it is for fog volumes (.vdb), and the scene is a mesh"},
      {"ground-height", uses_reference_plane(job),
       "there is no ground (--ground), and nothing else refers to the reference plane (--calibration, --nesz, --layers)"},
  };
  std::vector<std::string> lines;
  for (const Rule& rule : rules) {
    if (!rule.matters && o.given.contains(rule.option))
      lines.push_back(std::string("--") + rule.option + " has no effect: " + rule.why_not);
  }
  return lines;
}

}  // namespace sarnerf::app
