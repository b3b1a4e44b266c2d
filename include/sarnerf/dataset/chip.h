// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/phoenix.h"

/// Measured images in the terms of this project, whatever file they come from.
namespace sarnerf {

/// A measured image of a target. Rows are azimuth rows i, columns slant-range bins j, near to far; the view says so
/// and has the image's size, but no place in a dataset yet.
struct Chip {
  DatasetView view;
  Image<float> image;  ///< linear amplitude, not calibrated, unless the set says power
  double nominal_depression_deg = 0.0;  ///< what the set is filed under: 15, 17, 30
  bool depression_is_nominal = false;   ///< no measured one is known, the view has the nominal one
  bool range_is_assumed = false;
  std::optional<Resolution> resolution;  ///< of its impulse response, where the file says it
};

/// An azimuth of any number of turns brought to [0°, 360°).
double within_circle_deg(double azimuth_deg);

/// The unmirrored reading of a chip (drawn in docs/conventions.md):
///
///     j = n_rows − 1 − row    i = n_columns − 1 − column    φ = TargetAz
///
/// so that at TargetAz 0 the radar stands over +Z, and growing TargetAz moves it towards +X. Measured depression and
/// range where the file has them, else the desired ones, else `assumed_range_m`. The view's class is TargetType, its
/// serial TargetSerNum, its source the name inside the file.
Chip chip_of(const PhoenixChip& phoenix, double assumed_range_m);

/// The way back: the Phoenix chip of an amplitude image [n_azimuth × n_range] seen as the view says, phases 0. A
/// left-looking view becomes the right-looking one of the same geometry, which has its rows reversed. Throws
/// UsageError where the image has not the view's size.
PhoenixChip phoenix_of(const DatasetView& view, const Image<float>& amplitude);

/// The middle of an image, n_azimuth × n_range pixels of it, with the view to match. Where an odd number of pixels
/// goes, one more goes at the end of the rows or columns: the aim point moves by half a pixel. Throws InputError,
/// naming `where`, for an image smaller than that.
Chip cropped(Chip chip, int n_azimuth, int n_range, const std::string& where);

}  // namespace sarnerf
