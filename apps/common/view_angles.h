// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace sarnerf::app {

/// Limits of altitude and slant range: beyond the moon's orbit, or on a laboratory's table, nothing is a SAR.
inline constexpr double kNearestRadar_m = 1e-3, kFarthestRadar_m = 1e9;

/// Incidences (deg) of --pitch or --depression, as parse_angles_deg() reads them; none where both are empty. Throws
/// UsageError for angles that no view can have and where the two contradict each other.
std::vector<double> incidences_deg(const std::string& pitch, const std::string& depression);

}  // namespace sarnerf::app
