// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "program.h"
#include "sarnerf/core/files.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/dataset/phoenix.h"

/// A folder of chips and pictures for sar_import to read: 12 × 10 pixels (rows × columns), each of them different.
class ChipFolder : public ScratchFolder {
 public:
  Outcome run(const std::vector<std::string>& arguments) const {
    return sar_import(arguments, {path()});
  }

  static sarnerf::PhoenixChip chip(double azimuth_deg, double depression_deg = 17.0) {
    sarnerf::PhoenixChip chip;
    chip.target_azimuth_deg = azimuth_deg;
    chip.desired_depression_deg = depression_deg;
    chip.measured_depression_deg = depression_deg + 0.1;
    chip.desired_range_m = 4500.0;
    chip.measured_range_m = 4475.0;
    chip.range_spacing_m = 0.202;
    chip.cross_range_spacing_m = 0.203;
    chip.target_type = "truck";
    chip.target_serial = "1";
    chip.file_name = "original.000";
    chip.magnitude = sarnerf::Image<float>(12, 10);
    chip.phase_rad = sarnerf::Image<float>(12, 10);
    float value = 0.1f + static_cast<float>(azimuth_deg);
    for (float& pixel : chip.magnitude.pixels()) pixel = value += 0.01f;
    return chip;
  }

  void write(const std::string& name, const std::vector<std::byte>& bytes) const {
    sarnerf::make_folder((*this / name).parent_path());
    sarnerf::AtomicFiles files(sarnerf::Durability::process);
    files.add(*this / name, bytes);
    files.commit();
  }
  void write(const std::string& name, const sarnerf::PhoenixChip& chip) const {
    write(name, encode_phoenix(chip));
  }
  void write_picture(const std::string& name, float value = 0.5f) const {
    write(name, sarnerf::encode_tiff(sarnerf::Image<float>(12, 10, value)));
  }

  /// Names and contents of all files below.
  std::map<std::string, std::string> contents(const std::filesystem::path& below) const { return contents_of(*this / below); }
};

/// Whether the last line is an error of sar_import that holds the piece.
inline bool is_import_error(const Outcome& outcome, const std::string& piece) {
  const std::string& text = outcome.err;
  if (text.empty() || text.back() != '\n') return false;
  const std::size_t before = text.rfind('\n', text.size() - 2);
  const std::string last = text.substr(before == std::string::npos ? 0 : before + 1);
  return last.starts_with("sar_import: error: ") && has(last, piece);
}
