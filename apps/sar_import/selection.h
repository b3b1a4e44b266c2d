// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "source.h"

namespace sarnerf::app {

/// Of many sources those to be imported.
struct Choice {
  std::vector<Source> chosen;         ///< by class, serial, depression, azimuth
  std::vector<std::string> left_out;  ///< how many and why, a line each
};

/// Applies --class, --depression and --every, and fills in class and depression where the sources have none. With
/// --every each class, serial and nominal depression has a grid of its own; a grid azimuth gets the nearest image within
/// half a step that no other has got. Throws UsageError where nothing is left or a depression is not known.
Choice choose(std::vector<Source> sources, const Selection& selection);

/// Same class, serial and nominal depression.
bool same_set(const Source& a, const Source& b);

/// Angle from a to b (deg) the short way round: 0 to 180.
double apart_deg(double a_deg, double b_deg);

/// A warning where neighbours of a set were taken from the same azimuth; else empty.
std::string duplicates_text(const std::vector<Source>& chosen);

}  // namespace sarnerf::app
