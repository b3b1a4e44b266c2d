// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/manifest.h"

/// Phoenix files, the form in which the MSTAR target chips are published: a header of ASCII lines "Name= value", then
/// the magnitudes of all pixels, then their phases.
namespace sarnerf {

/// Whether a text begins as Phoenix files do: with "[PhoenixHeaderVer", after a line break in published files. The first
/// kPhoenixHeadBytes bytes of a file suffice.
bool begins_as_phoenix(std::string_view text);
inline constexpr std::size_t kPhoenixHeadBytes = 24;

/// A chip as stored in its file. Row 0 lies at far range and the radar below the last row. docs/method/conventions.md draws
/// the conversion to this project's axes; chip_of() does it.
struct PhoenixChip {
  double target_azimuth_deg = 0.0;                                        ///< TargetAz
  std::optional<double> desired_depression_deg, measured_depression_deg;  ///< at least one
  std::optional<double> desired_range_m, measured_range_m;                ///< radar to aim point
  double range_spacing_m = 0.0, cross_range_spacing_m = 0.0;              ///< of rows; of columns
  std::optional<Resolution> resolution;  ///< where the header states widths and a "-35dB_Taylor" or similar for both axes
  std::string target_type, target_serial, file_name;                      ///< empty: unknown

  Image<float> magnitude;  ///< [rows × columns], linear amplitude
  Image<float> phase_rad;  ///< the same size
};

/// Reads a file's bytes; `where` names them in messages. Throws InputError for a header that is not a Phoenix header, lacks
/// the angles or a spacing, or contradicts itself (desired and measured depression more than 3° apart, a radar that is
/// not at the bottom), for fewer bytes than it promises, and for pixels that are not magnitudes and phases, as with a
/// wrong byte order. Cost: one pass over the bytes.
PhoenixChip parse_phoenix(std::span<const std::byte> bytes, const std::string& where);

/// parse_phoenix() on a file.
PhoenixChip read_phoenix(const std::filesystem::path& path);

/// The bytes of a file that parse_phoenix() reads back, with bit-identical pixels. Throws UsageError for magnitudes that
/// are not finite or below zero, sizes that differ and a chip without depression.
std::vector<std::byte> encode_phoenix(const PhoenixChip& chip);

}  // namespace sarnerf

/// Measured images in the conventions of this project, whatever file format they come from.
namespace sarnerf {

/// A measured image of a target. Rows are azimuth rows i, columns slant-range bins j, near to far. The view states
/// this and the image's size, but no path in a dataset yet.
struct Chip {
  DatasetView view;
  Image<float> image;  ///< linear amplitude, or power if the set holds power; not calibrated
  double nominal_depression_deg = 0.0;  ///< of the published set it belongs to: 15, 17, 30
  bool depression_is_nominal = false;   ///< the measured one is unknown; the view has the nominal one
  bool range_is_assumed = false;
  std::optional<Resolution> resolution;  ///< of its impulse response, where the file states it
};

/// Reduces an azimuth (deg) to [0°, 360°).
double within_circle_deg(double azimuth_deg);

/// The unmirrored reading of a chip (drawn in docs/method/conventions.md):
///
///     j = n_rows − 1 − row    i = n_columns − 1 − column    φ = TargetAz
///
/// so that at TargetAz 0 the radar stands over +Z, and growing TargetAz moves it towards +X. Depression and range
/// are the measured ones where the file has them, else the desired ones; a missing range is `assumed_range_m`. The view's
/// class is TargetType, its serial TargetSerNum, its source the name inside the file.
Chip chip_of(const PhoenixChip& phoenix, double assumed_range_m);

/// The inverse of chip_of(): the Phoenix chip of the view's amplitude image [n_azimuth × n_range], with phases 0. A
/// left-looking view becomes the right-looking one of the same geometry, which has its rows reversed. Throws
/// UsageError if the image does not have the view's size.
PhoenixChip phoenix_of(const DatasetView& view, const Image<float>& amplitude);

/// The central n_azimuth × n_range pixels of an image, with a view of that size. If an odd number of pixels is cut off,
/// one more is cut at the end of the rows or columns than at their beginning: the aim point moves by half a pixel. Throws
/// InputError, naming `where`, for a smaller image.
Chip cropped(Chip chip, int n_azimuth, int n_range, const std::string& where);

}  // namespace sarnerf
