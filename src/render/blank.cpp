// SPDX-License-Identifier: Apache-2.0
#include "blank.h"

#include <algorithm>

#include "sarnerf/render/framing.h"

namespace sarnerf {
namespace {

bool has_media(const Scene& scene) {
  return std::any_of(scene.mesh.material.begin(), scene.mesh.material.end(),
                     [&](std::uint32_t m) { return !scene.materials[m].opaque; });
}

/// All integrators but `exact` lose what cells scatter whose optical depth is large: exp(-103) is zero in
/// single precision, and few cells are cut short enough to escape.
bool vanishes_by_integrator(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence) {
  if (plan.integrator == Integrator::exact) return false;
  if (evidence.volume) return evidence.n_hits > 0;
  constexpr double kDense = 40.0;
  return std::any_of(scene.mesh.material.begin(), scene.mesh.material.end(), [&](std::uint32_t n) {
    const Material& m = scene.materials[n];
    const double two_way_per_m = m.extinction_per_m + m.extinction_back_per_m;
    return !m.opaque && m.scattering_per_m > 0.0 && two_way_per_m * plan.acquisition.range_spacing_m > kDense;
  });
}

}  // namespace

std::string explain_blank(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence) {
  const std::string swath = outside_swath_warning(scene, plan.acquisition);
  if (plan.fan.n_elevation == 0) {
    return "the image is blank: " +
           (swath.empty() ? std::string("no ray meets the scene inside the swath; check --aim and --size") : swath);
  }
  const bool all_dark = !evidence.volume && std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) {
    return m.opaque ? m.gamma0 == 0.0 : m.scattering_per_m == 0.0;
  });
  if (all_dark) {
    return "the image is blank: every material in use scatters nothing (gamma0 or scattering_per_m is "
           "0); see --materials";
  }
  if (vanishes_by_integrator(scene, plan, evidence)) {
    return "the image is blank: --integrator " + std::string(name(plan.integrator)) +
           " attenuates what a cell scatters by its own optical depth, and here cells are so dense that "
           "nothing is left; use --integrator exact";
  }
  if (!swath.empty()) {
    return "the image is blank: what it holds is shadow, or turned away from the radar; " + swath;
  }
  if (evidence.volume && evidence.n_hits > 0) {
    return "the image is blank: rays met the volume, but what they met scatters nothing, or lies outside the "
           "swath";
  }
  if (evidence.n_hits == 0 && has_media(scene)) {
    return "the image is blank: no ray met a face, and translucent solids gave nothing; the scene may be "
           "smaller than the spacing of the rays (--scale, --units, --spacing), or too thin to scatter";
  }
  if (evidence.n_hits == 0) {
    return "the image is blank: no ray met a triangle; the scene may be smaller than the spacing of "
           "the rays, check --scale, --units and --spacing";
  }
  return "the image is blank: rays met the scene, but only faces that show no backscatter to the radar "
         "(turned away, or dark materials) or that lie outside the swath";
}

}  // namespace sarnerf
