// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/field/field_sampler.h"

/// Scalar double-precision reference for trilinear.h and field_sampler.h: one voxel at a time, to be
/// read and checked, not to be fast. Tests compare the float32 versions with it.
namespace sarnerf::oracle {

void sample_trilinear(const BrickView<const double>& grid, std::span<const glm::dvec3> points_m,
                      std::span<double> samples);

void scatter_trilinear(const BrickView<double>& grid_gradients,
                       std::span<const glm::dvec3> points_m,
                       std::span<const double> sample_gradients);

void sample_field(const BrickView<const double>& grid, const FieldChannels& channels,
                  std::span<const glm::dvec3> points_m, const RayDirections& rays,
                  const FieldPoints<double>& out);

void sample_field_adjoint(const BrickView<double>& grid_gradients, const FieldChannels& channels,
                          std::span<const glm::dvec3> points_m, const RayDirections& rays,
                          std::span<const double> brightness,
                          const FieldPoints<const double>& point_gradients);

}  // namespace sarnerf::oracle
