// SPDX-License-Identifier: Apache-2.0
#include "ground_archive.h"

#include <algorithm>
#include <cmath>

#include "archive_text.h"
#include "image_tensor.h"

namespace sarnerf {

void add_ground(Archive& archive, const LevelGround& ground) {
  archive.tensors["ground_texture"] = tensor_of(ground.texture);
  add_text(archive, "ground",
           {{"height_m", ground.height_m},
            {"cell_m", ground.cell_m},
            {"first_m", {ground.first_x_m, ground.first_z_m}},
            {"incidence_rad", ground.incidence_rad},
            {"gain", ground.gain}});
}

std::shared_ptr<const LevelGround> ground_of(const Archive& archive, const std::string& where) {
  if (archive.tensors.find("ground_texture") == archive.tensors.end()) return nullptr;
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const torch::Tensor texture = archive.tensor("ground_texture", torch::kFloat, 2, where).contiguous();
  const Json text = text_of(archive, "ground", where);
  auto ground = std::make_shared<LevelGround>();
  ground->height_m = member<double>(text, "height_m", where);
  ground->cell_m = member<double>(text, "cell_m", where);
  const auto first_m = member<std::vector<double>>(text, "first_m", where);
  ground->incidence_rad = member<std::vector<double>>(text, "incidence_rad", where);
  ground->gain = member<std::vector<double>>(text, "gain", where);
  require(texture.numel() > 0 && texture.isfinite().all().item<bool>(), "the ground's texture is empty or not finite");
  require(first_m.size() == 2 && ground->cell_m > 0.0 && std::isfinite(ground->height_m), "the ground has no place");
  require(!ground->gain.empty() && ground->gain.size() == ground->incidence_rad.size() &&
              std::is_sorted(ground->incidence_rad.begin(), ground->incidence_rad.end()),
          "the ground's gains do not belong to its incidences");
  ground->first_x_m = first_m[0];
  ground->first_z_m = first_m[1];
  ground->texture = image_of(texture);
  return ground;
}

}  // namespace sarnerf
