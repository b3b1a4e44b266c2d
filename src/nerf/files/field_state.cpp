// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/surface_field.h"

namespace sarnerf {

namespace {

/// Origin and size of a field's voxels. Throws CheckpointError where they are missing or impossible.
GridTransform transform_of(const Json& text, const std::string& where) {
  const auto origin_m = member<std::vector<double>>(text, "origin_m", where);
  const GridTransform transform{
      origin_m.size() == 3 ? glm::dvec3(origin_m[0], origin_m[1], origin_m[2]) : glm::dvec3(NAN),
      member<double>(text, "voxel_size_m", where)};
  if (!(transform.voxel_size_m > 0.0) || !std::isfinite(transform.voxel_size_m) ||
      !std::isfinite(glm::dot(transform.origin_m, transform.origin_m)))
    throw CheckpointError(where + ": the origin or size of its voxels is missing or not finite; the file is damaged");
  return transform;
}

}  // namespace

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
  const auto degree = member<int>(text, "harmonics_degree", where);
  const GridTransform transform = transform_of(text, where);
  const auto scale = member<double>(text, "source_scale", where);
  require(degree >= 0 && degree <= kMaxHarmonicsDegree, "the degree of its harmonics is not 0, 1 or 2");
  require(std::isfinite(scale), "the scale of its brightness is not finite");

  const torch::Tensor& voxels = archive.tensor("voxels", torch::kLong, 1, where);
  const torch::Tensor& log_depth = archive.tensor("log_depth", torch::kFloat, 1, where);
  const torch::Tensor& coefficients = archive.tensor("coefficients", torch::kFloat, 2, where);
  require(log_depth.size(0) == voxels.size(0) && coefficients.size(0) == voxels.size(0) &&
              coefficients.size(1) == n_harmonics(degree),
          "the numbers of voxels and of their parameters differ");
  require(log_depth.isfinite().all().item<bool>() && coefficients.isfinite().all().item<bool>(),
          "parameters are not finite");

  CarvedVoxels carved = voxels_of(archive, where);
  GridField field(transform, degree, scale);
  field.set_voxels(std::move(carved.topology), carved.active, log_depth.clone(), coefficients.clone());
  field.ground = ground_of(archive, where);
  field.resolution = resolution_of(archive, where);
  return field;
}

namespace {

std::vector<double> numbers(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

Archive MlpField::state() const {
  Archive archive;
  add_voxels(archive, cache_.topology(), cache_.places());
  if (!units_.literal) archive.tensors["extinction"] = torch::tensor(cache_.extinction_per_m());
  archive.tensors["parameters"] = network_.parameters.detach().clone();
  if (ground) add_ground(archive, *ground);
  if (resolution) add_resolution(archive, *resolution);
  const MlpShape& s = network_.shape;
  add_text(archive, "field",
           {{"kind", kind()},
            {"depth", s.depth},
            {"width", s.width},
            {"skip", s.skip},
            {"position_frequencies", s.position_frequencies},
            {"direction_frequencies", s.direction_frequencies},
            {"box_min_m", numbers(network_.box_m.min)},
            {"box_max_m", numbers(network_.box_m.max)},
            {"reference_bin_m", units_.reference_bin_m},
            {"source_scale", units_.source_scale},
            {"integrator", name(units_.integrator)},
            {"origin_m", numbers(cache_.transform().origin_m)},
            {"voxel_size_m", cache_.transform().voxel_size_m},
            {"least_depth", cache_.least_depth()}});
  return archive;
}

MlpField restore_mlp_field(const Archive& archive, const std::string& where) {
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const Json text = text_of(archive, "field", where);
  const auto vector = [&](const char* name) {
    const auto v = member<std::vector<double>>(text, name, where);
    return v.size() == 3 ? glm::dvec3(v[0], v[1], v[2]) : glm::dvec3(NAN);
  };
  const auto number = [&](const char* name) { return member<double>(text, name, where); };
  const MlpShape shape{member<int>(text, "depth", where), member<int>(text, "width", where),
                       member<int>(text, "skip", where),
                       member<int>(text, "position_frequencies", where),
                       member<int>(text, "direction_frequencies", where)};
  Box box_m;
  box_m.min = vector("box_min_m");
  box_m.max = vector("box_max_m");
  const glm::dvec3 size = box_m.size();
  require(size.x > 0.0 && size.y > 0.0 && size.z > 0.0 && std::isfinite(glm::dot(size, size)),
          "its box is empty or not finite");
  const GridTransform transform = transform_of(text, where);
  MlpUnits units{number("reference_bin_m"), number("source_scale"), Integrator::exact,
                 member<std::string>(text, "kind", where) == "paper"};
  require(units.reference_bin_m > 0.0 && std::isfinite(units.reference_bin_m) &&
              units.source_scale >= 0.0 && std::isfinite(units.source_scale),
          "its range bin or the scale of its brightness is impossible");

  const torch::Tensor& parameters = archive.tensor("parameters", torch::kFloat, 1, where);
  std::int64_t expected = 0;
  try {
    units.integrator = integrator_from_name(member<std::string>(text, "integrator", where));
    expected = mlp_parameter_count(shape);
  } catch (const UsageError& error) {
    throw CheckpointError(where + ": " + error.what());
  }
  require(parameters.numel() == expected, "its network has another size than its weights");
  require(parameters.isfinite().all().item<bool>(), "weights are not finite");
  MlpNetwork network{shape, box_m, parameters.clone().contiguous().set_requires_grad(true)};

  MlpField field(std::move(network), units, transform, voxels_of(archive, where));
  if (!units.literal) {
    const torch::Tensor extinction = archive.tensor("extinction", torch::kFloat, 1, where).contiguous();
    require(extinction.isfinite().all().item<bool>() && (extinction >= 0.0).all().item<bool>(), "extinctions of voxels are impossible");
    require(static_cast<std::size_t>(extinction.numel()) == field.cache().n_voxels(), "the numbers of voxels and of their extinctions differ");
    field.restore_cache({extinction.data_ptr<float>(), field.cache().n_voxels()}, number("least_depth"));
  }
  field.ground = ground_of(archive, where);
  field.resolution = resolution_of(archive, where);
  return field;
}

Archive SurfaceField::state() const {
  Archive archive;
  add_voxels(archive, topology(), cache_.places());
  archive.tensors["distance"] = distance.detach().clone();
  archive.tensors["log_albedo"] = log_albedo.detach().clone();
  archive.tensors["exponent"] = exponent.detach().clone();
  if (has_bounce()) archive.tensors["log_bounce"] = log_bounce.detach().clone();
  if (has_directional()) archive.tensors["directional"] = directional.detach().clone();
  if (ground) add_ground(archive, *ground);
  if (resolution) add_resolution(archive, *resolution);
  add_text(archive, "field",
           {{"kind", kind()},
            {"origin_m", numbers(transform_.origin_m)},
            {"voxel_size_m", transform_.voxel_size_m},
            {"albedo_voxel_m", albedo_transform_.voxel_size_m},
            {"most_band_m", most_band_m_},
            {"sharpness_per_m", sharpness_per_m_}});
  return archive;
}

SurfaceField restore_surface_field(const Archive& archive, const std::string& where) {
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const Json text = text_of(archive, "field", where);
  const auto length = [&](const char* name) {
    const auto value = member<double>(text, name, where);
    require(value > 0.0 && std::isfinite(value), "the size of its albedo's voxels, its band or its sharpness is impossible");
    return value;
  };
  const GridTransform transform = transform_of(text, where);
  const double band_m = length("most_band_m");
  require(band_m > transform.voxel_size_m, "its band is narrower than a voxel");
  SurfaceField field(transform, voxels_of(archive, where).topology, length("albedo_voxel_m"), band_m);
  const auto take = [&](const char* name, torch::Tensor& to) {
    const torch::Tensor from = archive.tensor(name, torch::kFloat, to.dim(), where);
    require(from.sizes() == to.sizes(), "the numbers of voxels and of their parameters differ");
    require(from.isfinite().all().item<bool>(), "parameters are not finite");
    to.data().copy_(from);
  };
  take("distance", field.distance);
  take("log_albedo", field.log_albedo);
  take("exponent", field.exponent);
  if (archive.tensors.contains("log_bounce")) {
    field.start_bounce();
    take("log_bounce", field.log_bounce);
  }
  if (archive.tensors.contains("directional")) {
    field.start_directional();
    take("directional", field.directional);
  }
  field.set_sharpness(length("sharpness_per_m"));
  field.refresh();
  field.ground = ground_of(archive, where);
  field.resolution = resolution_of(archive, where);
  return field;
}

}  // namespace sarnerf
