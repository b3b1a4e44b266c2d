// SPDX-License-Identifier: Apache-2.0
#include "view_angles.h"

#include <cstdio>

#include "sarnerf/core/error.h"
#include "values.h"

namespace sarnerf::app {

std::vector<double> incidences_deg(const std::string& pitch_text,
                                   const std::string& depression_text) {
  const auto check = [](const char* option, double angle_deg) {
    if (angle_deg > 0.0 && angle_deg < 90.0) return;
    char text[120];
    std::snprintf(text, sizeof text,
                  "%s: expected degrees between 0 and 90, both excluded, found %.10g", option,
                  angle_deg);
    throw UsageError(text);
  };
  std::vector<double> pitch, depression;
  if (!pitch_text.empty()) pitch = parse_angles_deg("--pitch", pitch_text);
  if (!depression_text.empty()) depression = parse_angles_deg("--depression", depression_text);
  for (const double angle : pitch) check("--pitch", angle);
  for (double& angle : depression) {
    check("--depression", angle);
    angle = 90.0 - angle;
  }
  if (!pitch.empty() && !depression.empty() && pitch != depression) {
    throw UsageError("--pitch " + pitch_text + " and --depression " + depression_text +
                     " contradict each other: depression is 90 - pitch; give one of them");
  }
  return pitch.empty() ? depression : pitch;
}

}  // namespace sarnerf::app
