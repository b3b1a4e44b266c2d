// SPDX-License-Identifier: Apache-2.0
#include "blank.h"

#include <algorithm>

#include "sarnerf/render/framing.h"

namespace sarnerf {

std::string explain_blank(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence) {
  const std::string swath = outside_swath_warning(scene, plan.acquisition);
  if (plan.fan.n_elevation == 0) {
    return "the image is blank: " +
           (swath.empty() ? std::string("no ray meets the scene inside the swath; check --aim and --size") : swath);
  }
  const bool all_dark = std::all_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) {
    return m.opaque ? m.gamma0 == 0.0 : m.scattering_per_m == 0.0;
  });
  if (all_dark) {
    return "the image is blank: every material in use scatters nothing (gamma0 or scattering_per_m is "
           "0); see --materials";
  }
  if (!swath.empty()) {
    return "the image is blank: what it holds is shadow, or turned away from the radar; " + swath;
  }
  if (evidence.n_hits == 0) {
    return "the image is blank: no ray met a triangle; the scene may be smaller than the spacing of "
           "the rays, check --scale, --units and --spacing";
  }
  return "the image is blank: rays met the scene, but only faces that show no backscatter to the radar "
         "(turned away, or dark materials) or that lie outside the swath";
}

}  // namespace sarnerf
