// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/returned_share.h"

#include <algorithm>

#include "shining.h"

namespace sarnerf {
namespace {

constexpr double kLeast = 0.5, kMost = 2.0;

}  // namespace

double returned_share(GridField& field, const TrainingSet& set) {
  if (!set.clutter) return 1.0;
  const double ground_power = set.clutter->ground->mean_power(), scale = field.source_scale();
  double missing = 0.0, returned = 0.0;
  for (const PosedImage& image : set.images) {
    const Image<float> whole = render_view(field, image.acquisition);
    field.set_source_scale(0.0);
    const Image<float> ground = render_view(field, image.acquisition);
    field.set_source_scale(scale);
    const Image<float> weight = shining(whole, ground_power);
    for (std::size_t n = 0; n < weight.pixels().size(); ++n) {
      const double w = double{weight.pixels()[n]}, predicted = double{whole.pixels()[n]};
      missing += w * (double{image.power.pixels()[n]} - predicted);
      returned += w * (predicted - double{ground.pixels()[n]});
    }
  }
  return returned > 0.0 ? std::clamp(1.0 + missing / returned, kLeast, kMost) : 1.0;
}

}  // namespace sarnerf
