// SPDX-License-Identifier: Apache-2.0
#include "catch.h"
#include "chip_folder.h"

using namespace sarnerf;

namespace {

std::vector<double> azimuths_deg(const Dataset& dataset) {
  std::vector<double> result;
  for (const DatasetView& view : dataset.views) result.push_back(view.azimuth_deg);
  return result;
}

Dataset imported(const ChipFolder& folder, const std::vector<std::string>& arguments) {
  std::vector<std::string> all = arguments;
  all.insert(all.end(), {"-o", "out", "--overwrite", "-q"});
  const Outcome outcome = folder.run(all);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  return read_manifest(folder / "out");
}

}  // namespace

TEST_CASE("the chips nearest to a grid of azimuths are taken, each once", "[import]") {
  const ChipFolder folder;
  const double all_deg[] = {359.0, 3.0, 9.4, 10.5, 12.0, 29.0, 31.0, 180.0};
  for (std::size_t n = 0; n < std::size(all_deg); ++n)
    folder.write("chips/a." + std::to_string(n), ChipFolder::chip(all_deg[n]));
  write_text(folder / "chips/notes.txt", "not a chip");
  CHECK(azimuths_deg(imported(folder, {"mstar", "chips"})) ==
        std::vector<double>{3.0, 9.4, 10.5, 12.0, 29.0, 31.0, 180.0, 359.0});
  // 0: 359 before 3, across north; 10: 10.5; 20: none within 5; 30: 29 before 31, which is as near; 180.
  CHECK(azimuths_deg(imported(folder, {"mstar", "chips", "--every", "10"})) ==
        std::vector<double>{10.5, 29.0, 180.0, 359.0});
  // A last step that is shorter has an azimuth, too: 0, 100, 200, 300.
  folder.write("chips/a.300", ChipFolder::chip(300.0));
  CHECK(azimuths_deg(imported(folder, {"mstar", "chips", "--every", "100"})) == std::vector<double>{180.0, 300.0, 359.0});
  std::filesystem::remove(folder / "chips/a.300");

  // A depression of its own has a grid of its own.
  folder.write("chips/b.0", ChipFolder::chip(12.0, 30.0));
  folder.write("chips/b.1", ChipFolder::chip(14.0, 30.0));
  const Dataset both = imported(folder, {"mstar", "chips", "--every", "10"});
  CHECK(azimuths_deg(both) == std::vector<double>{10.5, 29.0, 180.0, 359.0, 12.0});
  CHECK(both.views[0].depression_deg() == Approx(17.1));
  CHECK(both.views[4].depression_deg() == Approx(30.1));
  CHECK(azimuths_deg(imported(folder, {"mstar", "chips", "--depression", "30"})) ==
        std::vector<double>{12.0, 14.0});
  CHECK(imported(folder, {"mstar", "chips", "--depression", "17,30"}).views.size() == 10);
}

TEST_CASE("a folder that is given twice counts once, by whatever name", "[import]") {
  const ChipFolder folder;
  folder.write("chips/a.0", ChipFolder::chip(3.0));
  std::filesystem::create_directory_symlink(folder / "chips", folder / "link");
  CHECK(imported(folder, {"mstar", "chips", "./chips/../chips", "link"}).views.size() == 1);
}

TEST_CASE("classes are chosen, and several targets in one dataset are pointed out", "[import]") {
  const ChipFolder folder;
  folder.write("a.000", ChipFolder::chip(10));
  PhoenixChip other = ChipFolder::chip(20);
  other.target_type = "tank";
  folder.write("b.000", other);
  const Outcome both = folder.run({"mstar", "a.000", "b.000", "a.000", "-o", "both"});
  CHECK(both.code == 0);
  CHECK(has(both.err, "2 targets (class and serial) in one dataset"));
  CHECK(read_manifest(folder / "both").views.size() == 2);
  const Dataset tanks = imported(folder, {"mstar", "a.000", "b.000", "--class", "tank"});
  REQUIRE(tanks.views.size() == 1);
  CHECK(tanks.views[0].class_name == "tank");
}

TEST_CASE("equal azimuths are warned of, by name, and kept", "[import]") {
  const ChipFolder folder;
  folder.write("a.000", ChipFolder::chip(10.0));
  folder.write("b.000", ChipFolder::chip(10.0));
  folder.write("c.000", ChipFolder::chip(11.0));
  folder.write("d.000", ChipFolder::chip(10.0, 30.0));
  const Outcome outcome = folder.run({"mstar", ".", "-o", "out"});
  CHECK(outcome.code == 0);
  CHECK(has(outcome.err, "warning: 1 pair of images has the same azimuth, such as a.000 and b.000 "
                         "at 10 deg; all are kept"));
  CHECK(read_manifest(folder / "out").views.size() == 4);
}

TEST_CASE("pictures get what the table and the options know", "[import]") {
  const ChipFolder folder;
  Image<float> counted(3, 2);
  for (std::size_t n = 0; n < 6; ++n) counted.pixels()[n] = static_cast<float>(n);
  folder.write("p/a.tif", encode_tiff(counted));
  folder.write("p/b.tif", encode_tiff(counted));
  folder.write("p/unknown.tif", encode_tiff(counted));
  write_text(folder / "t.csv",
             "file,azimuth_deg,depression_deg,slant_range_m,azimuth_spacing_m,range_spacing_m,"
             "class,serial,split\n"
             "p/a.tif,-10,17,4475,0.203,0.202,2S1,b01,train\n"
             "p/b.tif,20,15,,,,,,test\n");
  Dataset d =
      imported(folder, {"images", "p", "--csv", "t.csv", "--spacing", "0.5,0.4",
                        "--amplitude-scale", "4/8", "--class", "2S1", "--slant-range", "6000"});
  REQUIRE(d.views.size() == 2);
  CHECK(d.quantity == Quantity::amplitude);
  CHECK(d.calibration == Calibration::uncalibrated);
  CHECK(d.scale == 1.0);
  const DatasetView &b = d.views[0], &a = d.views[1];  // b has no serial, and "" comes before "b01"
  CHECK(a.azimuth_deg == 350.0);
  CHECK(a.depression_deg() == 17.0);
  CHECK(a.slant_range_m == 4475.0);
  CHECK(a.azimuth_spacing_m == 0.203);
  CHECK(a.range_spacing_m == 0.202);
  CHECK(a.source == "a.tif");
  CHECK(b.class_name == "2S1");
  CHECK(b.slant_range_m == 6000.0);
  CHECK(b.azimuth_spacing_m == 0.5);
  CHECK(b.range_spacing_m == 0.4);
  CHECK(d.splits.at("train") == std::vector{a.image});
  CHECK(d.splits.at("test") == std::vector{b.image});
  CHECK(has(d.provenance_json, R"("slant_range_m":{"value":6000.0,"views":1})"));
  CHECK(has(d.provenance_json, R"("depression_is_nominal":{"views":2})"));
  // File (3 rows, 2 columns) 0 1 / 2 3 / 4 5, far range on top: the last column is azimuth row 0, its end near range.
  const Image<float> image = read_image(folder / "out" / a.image);
  REQUIRE(image.n_azimuth() == 2);
  REQUIRE(image.n_range() == 3);
  CHECK(image(0, 0) == 2.5f);
  CHECK(image(0, 2) == 0.5f);
  CHECK(image(1, 0) == 2.0f);

  d = imported(folder, {"images", "p", "--csv", "t.csv", "--spacing", "0.5", "--orientation",
                        "radar", "--quantity", "power"});
  CHECK(d.quantity == Quantity::power);
  CHECK(read_image(folder / "out" / d.views[0].image).n_azimuth() == 3);
  CHECK(read_image(folder / "out" / d.views[0].image)(2, 1) == 5.0f);
}

TEST_CASE("names carry the azimuth when there is no table", "[import]") {
  const ChipFolder folder;
  folder.write_picture("p/50.2248_HB15087.tif");
  folder.write_picture("p/0.5_HB15000.tif");
  const Dataset d = imported(
      folder, {"images", "p", "--depression", "17", "--spacing", "0.203,0.202", "--class", "2S1"});
  CHECK(azimuths_deg(d) == std::vector<double>{0.5, 50.2248});
  CHECK(d.views[1].depression_deg() == 17.0);
  CHECK(d.views[1].class_name == "2S1");
  CHECK(d.views[1].slant_range_m == 4500.0);
}

TEST_CASE("a crop is the middle of each image", "[import]") {
  const ChipFolder folder;
  folder.write("a.000", ChipFolder::chip(10));
  const Image<float> whole =
      read_image(folder / "out" / imported(folder, {"mstar", "a.000"}).views[0].image);
  const Dataset d = imported(folder, {"mstar", "a.000", "--crop", "4x8"});
  CHECK(d.views[0].n_azimuth == 4);
  CHECK(d.views[0].n_range == 8);
  CHECK(read_image(folder / "out" / d.views[0].image)(0, 0) == whole(3, 2));
}
