// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "sarnerf/nerf/archive.h"

namespace sarnerf {

/// What a checkpoint says of the trainer itself.
struct TrainerJson {
  std::string options;  ///< options_json()
  std::int64_t steps = 0;
  double least_loss = 0.0;
};

void add_trainer_json(Archive& archive, const TrainerJson& trainer);
TrainerJson trainer_json(const Archive& archive, const std::string& where);

}  // namespace sarnerf
