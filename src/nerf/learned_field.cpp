// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/learned_field.h"

#include "archive_text.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/mlp_field.h"

namespace sarnerf {

Image<float> render_view(const LearnedField& field, const Acquisition& acquisition) {
  const double voxel_m = field.voxel_size_m();
  RaySampling sampling;
  sampling.ray_spacing_m = 0.5 * voxel_m;
  sampling.sub_rows = 3;
  sampling.longest_m = voxel_m;
  Acquisition centred = acquisition;
  centred.aim_m = glm::dvec3(0.0);
  std::vector<RowRequest> rows;
  for (int i = 0; i < acquisition.n_azimuth; ++i) rows.push_back({centred, i});
  Image<float> image(acquisition.n_azimuth, acquisition.n_range);
  field.render_rows(rows, sampling, image.pixels());
  field.correct_view(image, centred);
  return image;
}

std::unique_ptr<LearnedField> restore_field(const Archive& archive, const std::string& where) {
  const auto kind = member<std::string>(text_of(archive, "field", where), "kind", where);
  if (kind == "grid") return std::make_unique<GridField>(restore_grid_field(archive, where));
  if (kind == "mlp") return std::make_unique<MlpField>(restore_mlp_field(archive, where));
  throw CheckpointError(where + ": holds a field of kind '" + kind +
                        "', which this version does not know; it knows: grid, mlp");
}

}  // namespace sarnerf
