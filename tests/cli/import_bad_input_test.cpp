// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "catch.h"
#include "chip_folder.h"
#include "sarnerf/dataset/image_file.h"

using namespace sarnerf;

namespace {

void refused(const ChipFolder& folder, const std::vector<std::string>& arguments, int code,
             const char* piece) {
  const Outcome outcome = folder.run(arguments);
  INFO(outcome.err);
  CAPTURE(piece);
  CHECK(outcome.code == code);
  CHECK(outcome.out.empty());
  CHECK(is_import_error(outcome, piece));
  CHECK_FALSE(std::filesystem::exists(folder / "out/dataset.json"));
}

std::string text_of(const PhoenixChip& chip) {
  const auto bytes = encode_phoenix(chip);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string without_line(std::string text, const std::string& name) {
  const std::size_t at = text.find("\n" + name + "=") + 1;
  REQUIRE(at != 0);
  std::fill(text.begin() + static_cast<std::ptrdiff_t>(at),
            text.begin() + static_cast<std::ptrdiff_t>(text.find('\n', at)), ' ');
  return text;
}

}  // namespace

TEST_CASE("bad chips end an import with exit code 3 and one line that names the file", "[import]") {
  const ChipFolder folder;
  folder.write("good.000", ChipFolder::chip(10));
  const std::string good = text_of(ChipFolder::chip(20));
  const std::vector<std::string> command{"mstar", "good.000", "bad.001", "-o", "out"};
  const auto bad = [&](const std::string& text, const char* piece) {
    write_text(folder / "bad.001", text);
    refused(folder, command, 3, piece);
    refused(folder, command, 3, "bad.001: ");
  };
  bad(good.substr(0, good.size() - 100), "the chip is truncated");
  bad(without_line(good, "TargetAz"), "no TargetAz");
  bad(without_line(without_line(good, "DesiredDepression"), "MeasuredDepression"), "no depression");
  PhoenixChip two_angles = ChipFolder::chip(20);
  two_angles.desired_depression_deg = 30.0;
  bad(text_of(two_angles),
      "DesiredDepression 30 and MeasuredDepression 17.1 contradict each other");
  PhoenixChip near = ChipFolder::chip(20);
  near.measured_range_m = 1e-3;
  bad(text_of(near), "no radar image can be of this geometry");
  std::string swapped = good;
  for (std::size_t at = good.size() - 2 * 4 * 120; at < good.size(); at += 4)
    std::reverse(swapped.data() + at, swapped.data() + at + 4);
  bad(swapped, "little-endian");
  bad("no chip at all", "expected a Phoenix file");
  bad("", "expected a Phoenix file");
  std::filesystem::remove(folder / "bad.001");
  refused(folder, command, 3, "bad.001");

  std::filesystem::create_directory(folder / "empty");
  refused(folder, {"mstar", "empty", "-o", "out"}, 3, "expected Phoenix chips, found none");
}

TEST_CASE("bad SAMPLE files end an import with exit code 3", "[import]") {
  const ChipFolder folder;
  std::string header = "MATLAB 7.3 MAT-file, Platform: GLNXA64 HDF5 schema 1.00 .";
  header.resize(124, ' ');
  write_text(folder / "a.mat",
             header + std::string("\x00\x02IM", 4) + std::string(384, '\0') + "\x89HDF\r\n\x1a\n");
  refused(folder, {"sample", "a.mat", "-o", "out"}, 3,
          "a.mat: this is a MATLAB file of version 7.3 (HDF5)");
  write_text(folder / "a.mat", "MATLAB 5.0");
  refused(folder, {"sample", ".", "-o", "out"}, 3, "a.mat: expected a MATLAB file of version 5");
}

TEST_CASE("bad pictures and tables end an import with exit code 3", "[import]") {
  const ChipFolder folder;
  folder.write_picture("pictures/a.tif");
  const std::vector<std::string> command{"images",    "pictures", "--csv", "t.csv",
                                         "--spacing", "0.2",      "-o",    "out"};
  write_text(folder / "t.csv",
             "file,azimuth_deg,depression_deg\na.tif,1,17\nb.tif,2,17\nc.tif,3,17\n");
  refused(folder, command, 3,
          "2 of 3 files exist neither beside the table nor in pictures: b.tif, c.tif");
  write_text(folder / "t.csv", "file,azimuth_deg,depression_deg,incidence_deg\na.tif,1,17,17\n");
  refused(folder, command, 3, "contradict each other");
  write_text(folder / "t.csv", "file,azimuth_deg,depression_deg\na.tif,,17\n");
  refused(folder, command, 3, "azimuth_deg is empty");
  refused(folder, {"images", "pictures", "--spacing", "0.2", "-o", "out"}, 3,
          "no azimuth in the names of 1 image");

  write_text(folder / "t.csv", "file,azimuth_deg,depression_deg\na.tif,1,17\n");
  folder.write_picture("pictures/a.tif", -3.0f);
  refused(folder, command, 3, "a.tif: a pixel is negative");
  write_text(folder / "pictures/a.tif", "II*");
  refused(folder, command, 3, "a.tif");
}

TEST_CASE("what is not known or does not fit is a matter of usage", "[import]") {
  const ChipFolder folder;
  folder.write("chips/a.000", ChipFolder::chip(10));
  folder.write_picture("pictures/10_a.tif");
  refused(folder, {}, 2, "a command is needed");
  refused(folder, {"mstra", "chips"}, 2, "unknown command 'mstra' (mstar?)");
  refused(folder, {"mstar"}, 2, "PATHS is required");
  refused(folder, {"mstar", "chips", "--evry", "5"}, 2, "(--every?)");
  refused(folder, {"mstar", "chips", "--every", "0", "-o", "out"}, 2, "--every");
  refused(folder, {"mstar", "chips", "--class", "tank", "-o", "out"}, 2,
          "--class tank: there is none; the classes are truck");
  refused(folder, {"mstar", "chips", "--depression", "30", "-o", "out"}, 2,
          "the depressions are 17");
  refused(folder, {"mstar", "chips", "--depression", "90", "-o", "out"}, 2, "between 0 and 90");
  refused(folder, {"mstar", "chips", "--crop", "64x64", "-o", "out"}, 3,
          "a.000: 10 x 12 pixels (azimuth x range) cannot be");
  refused(folder, {"mstar", "chips", "--max-memory", "1M", "-o", "out"}, 2,
          "--max-memory allows 1 MiB");
  refused(folder, {"images", "pictures", "--spacing", "0.2", "-o", "out"}, 2,
          "give one, such as --depression 17");
  refused(folder, {"images", "pictures", "--depression", "17", "-o", "out"}, 2, "give --spacing");
  refused(folder, {"images", "pictures", "--amplitude-scale", "4/0"}, 2, "--amplitude-scale");
  refused(folder, {"phoenix", "chips", "-o", "out"}, 3, "the manifest cannot be opened");
}

TEST_CASE("pictures that take more memory than there is are refused by their headers", "[import]") {
  const ChipFolder folder;
  // 64 million pixels in a few hundred kilobytes.
  folder.write("pictures/10.0_a.png", encode_png(Image<std::uint8_t>(8000, 8000)));
  const std::vector<std::string> command = {"images", "pictures", "--depression", "17", "--spacing", "0.2", "-o", "out"};
  auto limited = command;
  limited.insert(limited.end(), {"--max-memory", "500M"});
  refused(folder, limited, 2, "10.0_a.png: about ");
  refused(folder, limited, 2, "--max-memory allows 500 MiB; use smaller images");
  limited.push_back("--dry-run");
  refused(folder, limited, 2, "--max-memory allows 500 MiB");
}

TEST_CASE("a damaged picture is told in one line", "[import]") {
  const ChipFolder folder;
  Image<std::uint8_t> levels(40, 40);
  for (int n = 0; n < 1600; ++n) levels.pixels()[static_cast<std::size_t>(n)] = static_cast<std::uint8_t>(n * 37);
  auto bytes = encode_png(levels);
  for (std::size_t n = bytes.size() / 2; n < bytes.size() / 2 + 8; ++n) bytes[n] ^= std::byte{0x5a};
  folder.write("pictures/10.0_a.png", bytes);
  const Outcome outcome = folder.run({"images", "pictures", "--depression", "17", "--spacing", "0.2", "-o", "out"});
  INFO(outcome.err);
  CHECK(outcome.code == 3);
  CHECK(is_import_error(outcome, "10.0_a.png"));
  CHECK(std::count(outcome.err.begin(), outcome.err.end(), '\n') == 1);
}
