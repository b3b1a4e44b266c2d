// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/input_text.h"
#include "sarnerf/dataset/phoenix.h"

namespace sarnerf {
namespace {

void append(std::string& header, const char* name, const std::string& value) {
  header += std::string(name) + "= " + in_one_line(value) + "\n";
}

/// The shortest text that reads back as the same double.
void append(std::string& header, const char* name, double value) {
  char text[40];
  for (const int digits : {6, 10, 15, 17}) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    if (std::stod(text) == value) break;
  }
  append(header, name, text);
}

void append(std::string& header, const char* name, const std::optional<double>& value) {
  if (value) append(header, name, *value);
}

/// Ten digits, so that the header is as long whatever the number.
std::string fixed_width(std::size_t number) {
  char text[32];
  std::snprintf(text, sizeof text, "%010zu", number);
  return text;
}

std::string header_text(const PhoenixChip& chip, std::size_t header_bytes) {
  const Image<float>& image = chip.magnitude;
  std::string h = "\n[PhoenixHeaderVer01.04]\n";
  append(h, "PhoenixHeaderLength", fixed_width(header_bytes));
  append(h, "PhoenixSigSize",
         fixed_width(header_bytes + 2 * sizeof(float) * image.pixels().size()));
  append(h, "PhoenixSigNum", std::string("0001"));
  append(h, "native_header_length", 0.0);
  append(h, "Filename", chip.file_name);
  append(h, "NumberOfColumns", static_cast<double>(image.n_range()));
  append(h, "NumberOfRows", static_cast<double>(image.n_azimuth()));
  append(h, "TargetType", chip.target_type);
  append(h, "TargetSerNum", chip.target_serial);
  append(h, "TargetAz", chip.target_azimuth_deg);
  append(h, "DesiredDepression", chip.desired_depression_deg);
  append(h, "DesiredRange", chip.desired_range_m);
  append(h, "MeasuredDepression", chip.measured_depression_deg);
  append(h, "MeasuredRange", chip.measured_range_m);
  append(h, "RadarPosition", std::string("bottom"));
  append(h, "RangePixelSpacing", chip.range_spacing_m);
  append(h, "CrossRangePixelSpacing", chip.cross_range_spacing_m);
  if (const auto& r = chip.resolution; r && r->window.kind == Window::Kind::taylor && r->window.nbar == Window{}.nbar) {
    append(h, "RangeResolution", r->range_m);
    append(h, "CrossRangeResolution", r->azimuth_m);
    append(h, "RangeWeighting", format("%.17gdB_Taylor", r->window.sidelobe_db));
    append(h, "CrossRangeWeighting", format("%.17gdB_Taylor", r->window.sidelobe_db));
  }
  return h + "[EndofPhoenixHeader]\n";
}

void append_big_endian(std::vector<std::byte>& bytes, const Image<float>& image) {
  for (const float value : image.pixels()) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int shift = 24; shift >= 0; shift -= 8)
      bytes.push_back(static_cast<std::byte>(bits >> shift));
  }
}

void require_writable(const PhoenixChip& chip) {
  const Image<float>&m = chip.magnitude, &p = chip.phase_rad;
  if (m.pixels().empty() || m.n_azimuth() != p.n_azimuth() || m.n_range() != p.n_range())
    throw UsageError("a Phoenix chip needs magnitudes and as many phases");
  if (!chip.desired_depression_deg && !chip.measured_depression_deg)
    throw UsageError("a Phoenix chip needs a depression, measured or desired");
  for (const float value : m.pixels())
    if (!std::isfinite(value) || value < 0.0f)
      throw UsageError("a Phoenix chip holds magnitudes, which are finite and not below 0");
}

}  // namespace

std::vector<std::byte> encode_phoenix(const PhoenixChip& chip) {
  require_writable(chip);
  const std::string header = header_text(chip, header_text(chip, 0).size());
  std::vector<std::byte> bytes;
  bytes.reserve(header.size() + 2 * sizeof(float) * chip.magnitude.pixels().size());
  for (const char c : header) bytes.push_back(static_cast<std::byte>(c));
  append_big_endian(bytes, chip.magnitude);
  append_big_endian(bytes, chip.phase_rad);
  return bytes;
}

}  // namespace sarnerf
