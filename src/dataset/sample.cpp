// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/sample.h"

#include "mat_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_text.h"
#include "sarnerf/dataset/depression.h"

namespace sarnerf {
namespace {

/// "b01" of "2s1_real_A_elevDeg_015_azCenter_011_22_serial_b01".
std::string serial_of(const std::string& stem) {
  constexpr std::string_view kMark = "_serial_";
  const std::size_t at = stem.rfind(kMark);
  return at == std::string::npos ? "" : in_one_line(stem.substr(at + kMark.size()), 60);
}

double positive(const MatFile& file, const char* name, const std::filesystem::path& path) {
  const double value = file.number(name);
  if (!(value > 0.0)) throw InputError(path.string() + ": " + name + ": expected a number above 0");
  return value;
}

}  // namespace

Chip read_sample(const std::filesystem::path& path, double assumed_range_m) {
  const MatFile file(path);
  PhoenixChip chip;
  chip.target_azimuth_deg = file.number("azimuth");
  chip.measured_depression_deg = file.number("elevation");
  if (!is_depression(*chip.measured_depression_deg))
    throw InputError(path.string() +
                     ": elevation: expected degrees between 0 and 90, both excluded");
  chip.range_spacing_m = positive(file, "range_pixel_spacing", path);
  chip.cross_range_spacing_m = positive(file, "xrange_pixel_spacing", path);
  chip.target_type = file.text("target_name");
  chip.target_serial = serial_of(path.stem().string());
  chip.file_name = path.filename().string();
  // MATLAB stores columns one after the other: read row by row, that is the transpose already.
  chip.magnitude = file.magnitudes("complex_img");
  return chip_of(chip, assumed_range_m);
}

}  // namespace sarnerf
