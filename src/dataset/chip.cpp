// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/chip.h"

#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {
namespace {

/// Of a Phoenix chip's rows and columns, when the radar looks right. Turning an image by these is its own inverse.
constexpr std::array kChipAxes{Axis::minus_j, Axis::minus_i};

}  // namespace

double within_circle_deg(double azimuth_deg) {
  double turned = std::fmod(azimuth_deg, 360.0);
  if (turned < 0.0) turned += 360.0;
  return turned < 360.0 ? turned : 0.0;  // 360 less next to nothing rounds to 360
}

Chip chip_of(const PhoenixChip& phoenix, double assumed_range_m) {
  Chip chip;
  chip.image = to_radar_axes(phoenix.magnitude, kChipAxes);
  const double depression_deg =
      phoenix.measured_depression_deg.value_or(phoenix.desired_depression_deg.value_or(0.0));
  chip.depression_is_nominal = !phoenix.measured_depression_deg;
  const double rounded_deg = std::round(depression_deg);
  chip.nominal_depression_deg =
      phoenix.desired_depression_deg.value_or(rounded_deg > 0.0 ? rounded_deg : depression_deg);
  chip.resolution = phoenix.resolution;
  chip.range_is_assumed = !phoenix.measured_range_m && !phoenix.desired_range_m;

  DatasetView& view = chip.view;
  view.azimuth_deg = within_circle_deg(phoenix.target_azimuth_deg);
  view.incidence_deg = 90.0 - depression_deg;
  view.slant_range_m =
      phoenix.measured_range_m.value_or(phoenix.desired_range_m.value_or(assumed_range_m));
  view.n_azimuth = chip.image.n_azimuth();
  view.n_range = chip.image.n_range();
  view.azimuth_spacing_m = phoenix.cross_range_spacing_m;
  view.range_spacing_m = phoenix.range_spacing_m;
  view.class_name = phoenix.target_type;
  view.serial = phoenix.target_serial;
  view.source = phoenix.file_name;
  return chip;
}

PhoenixChip phoenix_of(const DatasetView& view, const Image<float>& amplitude) {
  if (amplitude.n_azimuth() != view.n_azimuth || amplitude.n_range() != view.n_range)
    throw UsageError("a view and its image differ in size");
  PhoenixChip phoenix;
  phoenix.target_azimuth_deg = view.azimuth_deg;
  phoenix.desired_depression_deg = phoenix.measured_depression_deg = view.depression_deg();
  phoenix.desired_range_m = phoenix.measured_range_m = view.slant_range_m;
  phoenix.range_spacing_m = view.range_spacing_m;
  phoenix.cross_range_spacing_m = view.azimuth_spacing_m;
  phoenix.target_type = view.class_name;
  phoenix.target_serial = view.serial;
  phoenix.file_name = view.source;
  phoenix.magnitude = to_radar_axes(
      amplitude, view.look == Look::right ? kChipAxes : std::array{Axis::plus_j, Axis::minus_i});
  phoenix.phase_rad = Image<float>(phoenix.magnitude.n_azimuth(), phoenix.magnitude.n_range());
  return phoenix;
}

Chip cropped(Chip chip, int n_azimuth, int n_range, const std::string& where) {
  const Image<float>& whole = chip.image;
  if (whole.n_azimuth() < n_azimuth || whole.n_range() < n_range)
    throw InputError(
        where + ": " + std::to_string(whole.n_azimuth()) + " x " + std::to_string(whole.n_range()) +
        " pixels (azimuth x range) cannot be cropped to " + std::to_string(n_azimuth) + " x " +
        std::to_string(n_range) + "; choose a smaller crop or leave this image out");
  const int i0 = (whole.n_azimuth() - n_azimuth) / 2, j0 = (whole.n_range() - n_range) / 2;
  Image<float> middle(n_azimuth, n_range);
  for (int i = 0; i < n_azimuth; ++i)
    for (int j = 0; j < n_range; ++j) middle(i, j) = whole(i0 + i, j0 + j);
  chip.image = std::move(middle);
  chip.view.n_azimuth = n_azimuth;
  chip.view.n_range = n_range;
  return chip;
}

}  // namespace sarnerf
