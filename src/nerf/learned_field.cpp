// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/learned_field.h"

#include <algorithm>
#include <cmath>

#include "archive_text.h"
#include "sarnerf/core/convolve_power.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/inner_image.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/mlp_field.h"

namespace sarnerf {

namespace {

/// The border that an image's response needs, as far as there are bins in front of the radar.
Border border_in_front(const ImpulseResponse& response, const Acquisition& a) {
  Border border = border_of(response, a.n_azimuth, a.n_range);
  border.range = std::min(border.range, static_cast<int>(a.range_m(0) / a.range_spacing_m - 1.0));
  border.range = std::max(border.range, 0);
  return border;
}

}  // namespace

Image<float> render_view(const LearnedField& field, const Acquisition& acquisition) {
  const double voxel_m = field.voxel_size_m();
  RaySampling sampling;
  sampling.ray_spacing_m = 0.5 * voxel_m;
  sampling.sub_rows = 3;
  sampling.longest_m = voxel_m;
  Acquisition centred = acquisition;
  centred.aim_m = glm::dvec3(0.0);
  ImpulseResponse response;
  if (field.resolution)
    response = impulse_response(*field.resolution, acquisition.azimuth_spacing_m, acquisition.range_spacing_m);
  const Border border = border_in_front(response, acquisition);
  const Acquisition wide = widened(centred, border);
  std::vector<RowRequest> rows;
  for (int i = 0; i < wide.n_azimuth; ++i) rows.push_back({wide, i});
  Image<float> image(wide.n_azimuth, wide.n_range);
  field.render_rows(rows, sampling, image.pixels());
  if (field.resolution) convolve_power(image, response);
  return without_border(std::move(image), border);
}

std::unique_ptr<LearnedField> restore_field(const Archive& archive, const std::string& where) {
  const auto kind = member<std::string>(text_of(archive, "field", where), "kind", where);
  if (kind == "grid") return std::make_unique<GridField>(restore_grid_field(archive, where));
  if (kind == "mlp") return std::make_unique<MlpField>(restore_mlp_field(archive, where));
  throw CheckpointError(where + ": holds a field of kind '" + kind +
                        "', which this version does not know; it knows: grid, mlp");
}

}  // namespace sarnerf
