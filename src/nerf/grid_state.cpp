// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "archive_text.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/grid_field.h"
#include "ground_archive.h"
#include "resolution_archive.h"
#include "voxel_archive.h"

namespace sarnerf {

Archive GridField::state() const {
  Archive archive;
  archive.tensors = {{"log_depth", log_depth.detach().clone()}, {"coefficients", coefficients.detach().clone()}};
  add_voxels(archive, topology_, active_);
  const glm::dvec3& o = transform_.origin_m;
  add_text(archive, "field",
           {{"kind", kind()},
            {"origin_m", {o.x, o.y, o.z}},
            {"voxel_size_m", transform_.voxel_size_m},
            {"harmonics_degree", channels_.harmonics_degree},
            {"source_scale", source_scale_}});
  if (ground) add_ground(archive, *ground);
  if (resolution) add_resolution(archive, *resolution);
  return archive;
}

GridField restore_grid_field(const Archive& archive, const std::string& where) {
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const Json text = text_of(archive, "field", where);
  const auto origin_m = member<std::vector<double>>(text, "origin_m", where);
  const auto degree = member<int>(text, "harmonics_degree", where);
  const GridTransform transform{
      origin_m.size() == 3 ? glm::dvec3(origin_m[0], origin_m[1], origin_m[2]) : glm::dvec3(NAN),
      member<double>(text, "voxel_size_m", where)};
  const auto scale = member<double>(text, "source_scale", where);
  require(degree >= 0 && degree <= kMaxHarmonicsDegree, "the degree of its harmonics is not 0, 1 or 2");
  require(transform.voxel_size_m > 0.0 && std::isfinite(glm::dot(transform.origin_m, transform.origin_m)) &&
              std::isfinite(transform.voxel_size_m) && std::isfinite(scale),
          "its voxels have no place or size");

  const torch::Tensor& voxels = archive.tensor("voxels", torch::kLong, 1, where);
  const torch::Tensor& log_depth = archive.tensor("log_depth", torch::kFloat, 1, where);
  const torch::Tensor& coefficients = archive.tensor("coefficients", torch::kFloat, 2, where);
  require(log_depth.size(0) == voxels.size(0) && coefficients.size(0) == voxels.size(0) &&
              coefficients.size(1) == n_harmonics(degree),
          "voxels and parameters are not as many");
  require(log_depth.isfinite().all().item<bool>() && coefficients.isfinite().all().item<bool>(),
          "parameters are not finite");

  CarvedVoxels carved = voxels_of(archive, where);
  GridField field(transform, degree, scale);
  field.set_voxels(std::move(carved.topology), carved.active, log_depth.clone(), coefficients.clone());
  field.ground = ground_of(archive, where);
  field.resolution = resolution_of(archive, where);
  return field;
}

}  // namespace sarnerf
