// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/nerf/trainer.h"

namespace sarnerf {

/// Images of small_grid() from evenly spread azimuths, 8 × 16 pixels each.
TrainingSet small_set(int n_views);

/// Options for it: half a minute of training for an image of a radar is a tenth of a second here.
TrainerOptions small_options(const TrainingSet& set);

/// Whether two archives hold the same text and the same bits.
inline bool same_bits(const Archive& a, const Archive& b) {
  if (a.json != b.json || a.tensors.size() != b.tensors.size()) return false;
  for (const auto& [name, tensor] : a.tensors) {
    const auto found = b.tensors.find(name);
    if (found == b.tensors.end() || !torch::equal(tensor, found->second)) return false;
  }
  return true;
}

}  // namespace sarnerf
