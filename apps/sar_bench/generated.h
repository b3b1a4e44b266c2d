// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sarnerf/scene/scene.h"

namespace sarnerf::bench {

/// A closed, bumpy sphere of about `n_triangles` and the given mean radius (m), standing on y = 0: the
/// same shape at every resolution, so that only the number of triangles changes.
Scene bumpy_sphere(std::uint64_t n_triangles, double radius_m);

}  // namespace sarnerf::bench
