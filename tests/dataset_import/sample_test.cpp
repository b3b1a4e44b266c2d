// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_index.h"

#include <cmath>

#include "catch.h"
#include "sample_files.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::string refusal(const std::filesystem::path& path) {
  try {
    read_sample(path, 4500.0);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

void says(const std::filesystem::path& path, const char* piece) {
  const std::string message = refusal(path);
  INFO(message);
  CHECK(message.find(path.string()) == 0);
  CHECK(message.find(piece) != std::string::npos);
}

}  // namespace

TEST_CASE("a SAMPLE file is the transpose of a chip") {
  const ScratchFolder folder;
  for (const bool compressed : {true, false}) {
    SampleFile file;
    file.compressed = compressed;
    file.write(folder / "2s1_real_A_elevDeg_015_azCenter_011_22_serial_b01.mat");
    const Chip chip =
        read_sample(folder / "2s1_real_A_elevDeg_015_azCenter_011_22_serial_b01.mat", 4600.0);
    // The matrix has 3 rows and 4 columns; the chip, its transpose, has 4 rows (range) and 3 columns (azimuth).
    REQUIRE(chip.view.n_azimuth == 3);
    REQUIRE(chip.view.n_range == 4);
    const auto element = [](int row, int column) {
      return static_cast<float>(std::hypot(row + 1, 10.0 * (column + 1)));
    };
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column)
        CHECK(chip.image(2 - row, 3 - column) == element(row, column));
    CHECK(chip.view.azimuth_deg == 11.22484);
    CHECK(chip.view.depression_deg() == Approx(15.04));
    CHECK(chip.nominal_depression_deg == 15.0);
    CHECK(chip.view.range_spacing_m == 0.202148);
    CHECK(chip.view.azimuth_spacing_m == 0.203125);
    CHECK(chip.view.class_name == "2s1_gun");
    CHECK(chip.view.serial == "b01");
    CHECK(chip.view.slant_range_m == 4600.0);
    CHECK(chip.range_is_assumed);
  }
}

TEST_CASE("MATLAB files that are no SAMPLE chips are refused in one line") {
  const ScratchFolder folder;
  const auto path = folder / "a.mat";
  SampleFile file;
  file.with_image = false;
  file.write(path);
  says(path, "no variable complex_img");
  file = {};
  file.numbers.erase("azimuth");
  file.write(path);
  says(path, "no variable azimuth");
  file = {};
  file.numbers["elevation"] = 0.0;
  file.write(path);
  says(path, "elevation: expected degrees between 0 and 90");
  file = {};
  file.numbers["range_pixel_spacing"] = std::nan("");
  file.write(path);
  says(path, "range_pixel_spacing: expected a finite number");
  file = {};
  file.numbers["xrange_pixel_spacing"] = -1.0;
  file.write(path);
  says(path, "xrange_pixel_spacing: expected a number above 0");
  file = {};
  file.target_name.clear();
  file.write(path);
  says(path, "no variable target_name");

  write_text(path, "II*");
  says(path, "expected a MATLAB file of version 5");
  write_text(path, "");
  says(path, "expected a MATLAB file of version 5");
  says(folder / "missing.mat", "missing.mat");
}

TEST_CASE("version 7.3 is refused by name") {
  const ScratchFolder folder;
  // What MATLAB writes: words, version and byte order in 128 bytes, HDF5 from byte 512.
  std::string header =
      "MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema "
      "1.00 .";
  header.resize(124, ' ');
  write_text(folder / "a.mat",
             header + std::string("\x00\x02IM", 4) + std::string(384, '\0') + "\x89HDF\r\n\x1a\n");
  says(folder / "a.mat", "version 7.3 (HDF5), which is not read");
}

TEST_CASE("a truncated SAMPLE file is refused wherever it ends") {
  const ScratchFolder folder;
  SampleFile{}.write(folder / "whole.mat");
  const std::string whole = read_text(folder / "whole.mat");
  for (std::size_t n = 0; n < whole.size(); ++n) {
    write_text(folder / "a.mat", whole.substr(0, n));
    const std::string message = refusal(folder / "a.mat");
    CAPTURE(n, whole.size(), message);
    CHECK(message.find("a.mat: ") != std::string::npos);
  }
}
