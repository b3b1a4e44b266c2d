// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <span>

#include "sarnerf/core/units.h"
#include "sarnerf/dataset/phoenix.h"

namespace sarnerf::test {

/// 48 rows of 0.2 m and 40 columns of 0.21 m, with all that a header may say; every pixel differs.
inline PhoenixChip numbered_chip() {
  PhoenixChip chip;
  chip.target_azimuth_deg = 346.491974;
  chip.desired_depression_deg = 17.0;
  chip.measured_depression_deg = 17.09375;
  chip.desired_range_m = 4500.0;
  chip.measured_range_m = 4475.0;
  chip.range_spacing_m = 0.2;
  chip.cross_range_spacing_m = 0.21;
  chip.target_type = "bmp2_tank";
  chip.target_serial = "9563";
  chip.file_name = "hb03787.0000";
  chip.magnitude = Image<float>(48, 40);
  chip.phase_rad = Image<float>(48, 40);
  for (std::size_t n = 0; n < chip.magnitude.pixels().size(); ++n) {
    chip.magnitude.pixels()[n] = 0.01f + 0.0007f * static_cast<float>(n);
    chip.phase_rad.pixels()[n] = 0.003f * static_cast<float>(n);
  }
  return chip;
}

/// A point of a target on the ground: metres to the right and up in the picture of the chip with TargetAz 0, that is,
/// with the radar below the picture.
struct GroundPoint {
  double right_m = 0.0, up_m = 0.0;
};

/// The chip of bright points, drawn as such chips are and without any of the project's geometry: row 0 far from the
/// radar, and the picture turning clockwise while TargetAz grows. Ranges are foreshortened by cos(depression), the
/// wave fronts plane.
inline PhoenixChip drawn_chip(std::span<const GroundPoint> points, double azimuth_deg) {
  PhoenixChip chip = numbered_chip();
  chip.target_azimuth_deg = azimuth_deg;
  chip.measured_range_m = 1e6;  // plane wave fronts
  chip.phase_rad = Image<float>(48, 40);
  const double a = rad_from_deg(azimuth_deg), c = std::cos(a), s = std::sin(a);
  const double cos_depression = std::cos(rad_from_deg(*chip.measured_depression_deg));
  for (int row = 0; row < 48; ++row) {
    for (int column = 0; column < 40; ++column) {
      double sum = 0.001;
      for (const GroundPoint& p : points) {
        const double right_m = p.right_m * c + p.up_m * s, up_m = -p.right_m * s + p.up_m * c;
        const double dx = right_m - (column - 19.5) * chip.cross_range_spacing_m;
        const double dy = up_m * cos_depression - (23.5 - row) * chip.range_spacing_m;
        sum += std::exp(-0.5 * (dx * dx + dy * dy) / (0.25 * 0.25));
      }
      chip.magnitude(row, column) = static_cast<float>(sum);
    }
  }
  return chip;
}

}  // namespace sarnerf::test
