// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <string>

namespace sarnerf {

enum class ValueRule {
  finite,
  not_negative,  ///< and finite
};

/// Throws InputError unless the background is 0 and every active value, multiplied by `factor`, keeps the
/// rule; says how many do not, and the first of them. `where` names file and grid. All threads.
void require_values(const openvdb::FloatGrid& grid, ValueRule rule, double factor, const std::string& where);
/// Throws InputError unless every active value is finite; for distances, whose background is not 0.
void require_finite_distances(const openvdb::FloatGrid& grid, const std::string& where);
/// The same as require_values() for vectors, which must be finite, and for components, 0 to 4.
void require_vectors(const openvdb::Vec3SGrid& grid, const std::string& where);
void require_components(const openvdb::Int32Grid& grid, const std::string& where);

/// Multiplies every value, active or not. All threads.
void multiply_values(openvdb::FloatGrid& grid, double factor);

}  // namespace sarnerf
