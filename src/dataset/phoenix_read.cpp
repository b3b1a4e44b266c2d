// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "phoenix_header.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/depression.h"
#include "sarnerf/dataset/phoenix.h"

namespace sarnerf {
namespace {

constexpr std::size_t kMostSide = 65535;

/// Measured depressions lie within a degree of the desired ones; further away one of the two is a mistake, and
/// nothing tells which.
constexpr double kMostDepressionError_deg = 3.0;

/// Amplitudes of any calibration lie far inside; floats whose bytes are the wrong way round do not.
constexpr float kMostMagnitude = 1e15f, kLeastPeak = 1e-20f;
constexpr float kMostPhase_rad = static_cast<float>(2.0 * kPi) + 1e-3f;

enum class ByteOrder { big, little };

float float_at(const std::byte* at, ByteOrder order) {
  std::uint32_t bits = 0;
  for (int n = 0; n < 4; ++n)
    bits = bits << 8 | std::to_integer<std::uint32_t>(at[order == ByteOrder::big ? n : 3 - n]);
  return std::bit_cast<float>(bits);
}

Image<float> floats(std::span<const std::byte> bytes, int n_rows, int n_columns, ByteOrder order) {
  Image<float> image(n_rows, n_columns);
  const std::byte* at = bytes.data();
  for (float& value : image.pixels()) {
    value = float_at(at, order);
    at += sizeof(float);
  }
  return image;
}

bool are_magnitudes(const Image<float>& image) {
  float most = 0.0f;
  for (const float value : image.pixels()) {
    if (!(value >= 0.0f && value <= kMostMagnitude)) return false;
    most = std::max(most, value);
  }
  return most == 0.0f || most >= kLeastPeak;
}

bool are_phases(const Image<float>& image) {
  return std::all_of(image.pixels().begin(), image.pixels().end(),
                     [](float value) { return std::abs(value) <= kMostPhase_rad; });
}

void read_pixels(std::span<const std::byte> data, int n_rows, int n_columns,
                 const PhoenixHeader& header, PhoenixChip& chip) {
  const auto magnitudes = data.first(data.size() / 2), phases = data.last(data.size() / 2);
  chip.magnitude = floats(magnitudes, n_rows, n_columns, ByteOrder::big);
  chip.phase_rad = floats(phases, n_rows, n_columns, ByteOrder::big);
  if (are_magnitudes(chip.magnitude) && are_phases(chip.phase_rad)) return;
  const bool swapped = are_magnitudes(floats(magnitudes, n_rows, n_columns, ByteOrder::little)) &&
                       are_phases(floats(phases, n_rows, n_columns, ByteOrder::little));
  header.fail(swapped ? "the pixels are magnitudes and phases in little-endian byte order only; "
                        "Phoenix files are "
                        "big-endian: swap the bytes of the data back"
                      : "the pixels are no magnitudes and phases: negative, not finite or beyond "
                        "all measure; the data "
                        "is damaged, or PhoenixHeaderLength wrong");
}

void check_depressions(const PhoenixChip& chip, const PhoenixHeader& header) {
  for (const auto& angle_deg : {chip.desired_depression_deg, chip.measured_depression_deg})
    if (angle_deg && !is_depression(*angle_deg))
      header.fail("expected depressions between 0 and 90 degrees, both excluded, found " +
                  std::to_string(*angle_deg));
  if (!chip.desired_depression_deg && !chip.measured_depression_deg)
    header.fail("the header has no depression: neither MeasuredDepression nor DesiredDepression");
  if (chip.desired_depression_deg && chip.measured_depression_deg &&
      std::abs(*chip.desired_depression_deg - *chip.measured_depression_deg) >
          kMostDepressionError_deg) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "DesiredDepression %.6g and MeasuredDepression %.6g contradict each other: they "
                  "are more than %g "
                  "degrees apart; correct or remove the wrong one",
                  *chip.desired_depression_deg, *chip.measured_depression_deg,
                  kMostDepressionError_deg);
    header.fail(text);
  }
}

std::optional<double> range_m(const PhoenixHeader& header, std::string_view name) {
  const auto value = header.number(name);
  if (value && !(*value > 0.0))
    header.fail(std::string(name) + ": expected metres above 0, found " + header.text(name));
  return value;
}

/// Of weightings as the headers write them, "-35dB_Taylor", with the usual four nearly equal sidelobes; none for others.
std::optional<Resolution> resolution_in(const PhoenixHeader& header) {
  const auto azimuth_m = header.number("CrossRangeResolution"), range_m = header.number("RangeResolution");
  const std::string weighting = header.text("RangeWeighting");
  const std::size_t unit = weighting.find("dB_Taylor");
  if (!azimuth_m || !range_m || !(*azimuth_m > 0.0) || !(*range_m > 0.0) || unit == std::string::npos ||
      header.text("CrossRangeWeighting") != weighting)
    return {};
  try {
    return Resolution{*azimuth_m, *range_m, window_from_text("taylor:" + weighting.substr(0, unit))};
  } catch (const UsageError&) {
    return {};
  }
}

}  // namespace

PhoenixChip parse_phoenix(std::span<const std::byte> bytes, const std::string& where) {
  const PhoenixHeader header({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, where);
  PhoenixChip chip;
  const auto n_rows = header.whole_number("NumberOfRows", 1, kMostSide);
  const auto n_columns = header.whole_number("NumberOfColumns", 1, kMostSide);
  const auto azimuth_deg = header.number("TargetAz");
  if (!azimuth_deg)
    header.fail("the header has no TargetAz, without which nobody knows where the radar stood");
  chip.target_azimuth_deg = *azimuth_deg;
  chip.desired_depression_deg = header.number("DesiredDepression");
  chip.measured_depression_deg = header.number("MeasuredDepression");
  check_depressions(chip, header);
  chip.desired_range_m = range_m(header, "DesiredRange");
  chip.measured_range_m = range_m(header, "MeasuredRange");
  chip.range_spacing_m = header.positive_number("RangePixelSpacing");
  chip.cross_range_spacing_m = header.positive_number("CrossRangePixelSpacing");
  chip.resolution = resolution_in(header);
  chip.target_type = header.text("TargetType");
  chip.target_serial = header.text("TargetSerNum");
  chip.file_name = header.text("Filename");
  if (const std::string place = header.text("RadarPosition"); !place.empty() && place != "bottom")
    header.fail("expected RadarPosition bottom, rows from far to near range; found '" + place +
                "'");

  const std::size_t head = header.whole_number("PhoenixHeaderLength", header.size(), bytes.size());
  const std::size_t native = header.number("native_header_length")
                                 ? header.whole_number("native_header_length", 0, bytes.size())
                                 : 0;
  const std::size_t begin = head + native,
                    expected = begin + 2 * sizeof(float) * n_rows * n_columns;
  if (bytes.size() < expected)
    header.fail("the chip is truncated: " + std::to_string(n_rows) + " x " +
                std::to_string(n_columns) + " magnitudes and phases end at byte " +
                std::to_string(expected) + ", the file at byte " + std::to_string(bytes.size()));
  read_pixels(bytes.subspan(begin, expected - begin), static_cast<int>(n_rows),
              static_cast<int>(n_columns), header, chip);
  return chip;
}

PhoenixChip read_phoenix(const std::filesystem::path& path) {
  const std::string file = read_whole_file(path);
  return parse_phoenix(std::as_bytes(std::span(file)), path.string());
}

}  // namespace sarnerf
