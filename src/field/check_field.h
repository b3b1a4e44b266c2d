// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/field/field_sampler.h"

namespace sarnerf {

inline void expect_field_length(std::size_t found, std::size_t expected, const char* what) {
  if (found != expected) {
    throw UsageError(std::string("field samples: ") + what + " has " + std::to_string(found) +
                     " values, expected " + std::to_string(expected));
  }
}

inline std::string basis_name(const FieldChannels& channels) {
  if (channels.basis == SourceBasis::scattering) return "scattering";
  if (channels.basis == SourceBasis::cosine) return "brightness, normal and exponent";
  return "harmonics of degree " + std::to_string(channels.harmonics_degree);
}

/// Throws UsageError for the bases that have no adjoint.
inline void expect_harmonics(const FieldChannels& channels) {
  if (channels.basis != SourceBasis::harmonics) {
    throw UsageError("the adjoint of a field exists for harmonics, not for " + basis_name(channels));
  }
}

template <class T>
void check_samples(const BrickView<const T>& grid, std::size_t n_points, std::size_t n_samples) {
  validate(grid);
  expect_field_length(n_samples, n_points * static_cast<std::size_t>(grid.n_channels),
                      "the array of interpolated channels");
}

/// Throws UsageError unless the channels are those of the grid.
inline void check_channels(int n_grid_channels, const FieldChannels& channels) {
  if (channels.harmonics_degree < 0 || channels.harmonics_degree > kMaxHarmonicsDegree) {
    throw UsageError("field samples: harmonics of degree 0 to 2 are known, found degree " +
                     std::to_string(channels.harmonics_degree));
  }
  if (channels.count() != n_grid_channels) {
    throw UsageError("field samples: the grid has " + std::to_string(n_grid_channels) +
                     " channels, but a field with " +
                     (channels.two_extinctions ? "two extinctions" : "one extinction") + " and " +
                     basis_name(channels) + " has " + std::to_string(channels.count()));
  }
}

/// Throws UsageError unless the channels are those of the grid and the arrays are as long as the points.
template <class T>
void check_field(int n_grid_channels, const FieldChannels& channels, const RayDirections& rays,
                 std::size_t n_points, const FieldPoints<T>& points) {
  check_channels(n_grid_channels, channels);
  expect_field_length(rays.ray_begin.size(), rays.ray_direction.size() + 1, "ray_begin");
  if (rays.ray_begin.front() != 0 || rays.ray_begin.back() != n_points ||
      !std::is_sorted(rays.ray_begin.begin(), rays.ray_begin.end())) {
    throw UsageError("field samples: ray_begin must ascend from 0 to the number of points, " +
                     std::to_string(n_points));
  }
  expect_field_length(points.extinction_per_m.size(), n_points, "extinction_per_m");
  expect_field_length(points.extinction_back_per_m.size(), channels.two_extinctions ? n_points : 0,
                      "extinction_back_per_m");
  expect_field_length(points.source.size(), n_points, "source");
}

}  // namespace sarnerf
