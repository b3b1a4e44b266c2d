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

/// Phoenix files, the form in which the MSTAR target chips are published: a header of ASCII lines "Name= value", then
/// the magnitudes of all pixels, then their phases.
namespace sarnerf {

/// Whether a text begins as Phoenix files do: with "[PhoenixHeaderVer", behind a line break in published ones. As many
/// bytes of a file suffice as kPhoenixHeadBytes says.
bool begins_as_phoenix(std::string_view text);
inline constexpr std::size_t kPhoenixHeadBytes = 24;

/// A chip as its file has it. Row 0 lies at far range and the radar below the last row; docs/conventions.md draws how
/// that is read, and chip_of() does it.
struct PhoenixChip {
  double target_azimuth_deg = 0.0;                                        ///< TargetAz
  std::optional<double> desired_depression_deg, measured_depression_deg;  ///< at least one
  std::optional<double> desired_range_m, measured_range_m;                ///< radar to aim point
  double range_spacing_m = 0.0, cross_range_spacing_m = 0.0;              ///< of rows; of columns
  std::optional<Resolution> resolution;  ///< where the header says widths and "-35dB_Taylor" or the like for both axes
  std::string target_type, target_serial, file_name;                      ///< empty: unknown

  Image<float> magnitude;  ///< [rows × columns], linear amplitude
  Image<float> phase_rad;  ///< the same size
};

/// Reads a file's bytes; `where` names them in messages. Throws InputError for a header that is no Phoenix header, lacks
/// the angles or a spacing, or contradicts itself (desired and measured depression more than 3° apart, a radar that is
/// not at the bottom), for fewer bytes than it promises, and for pixels that are no magnitudes and phases, which is how
/// the wrong byte order shows. Cost: one pass over the bytes.
PhoenixChip parse_phoenix(std::span<const std::byte> bytes, const std::string& where);

/// parse_phoenix() on a file.
PhoenixChip read_phoenix(const std::filesystem::path& path);

/// The bytes of a file that parse_phoenix() reads back, bit for bit in its pixels. Magnitudes that are not finite or
/// below zero, sizes that differ and a chip without depression are a UsageError.
std::vector<std::byte> encode_phoenix(const PhoenixChip& chip);

}  // namespace sarnerf
