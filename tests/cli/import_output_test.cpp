// SPDX-License-Identifier: Apache-2.0
#include <csignal>

#include "catch.h"
#include "chip_folder.h"

using namespace sarnerf;

namespace {

/// Chips at whole degrees from 0.
void write_chips(const ChipFolder& folder, int count) {
  for (int n = 0; n < count; ++n)
    folder.write("chips/hb." + std::to_string(n), ChipFolder::chip(n));
}

}  // namespace

TEST_CASE("an import is a dataset folder as sar_render's are, with a summary on stdout",
          "[import]") {
  const ChipFolder folder;
  write_chips(folder, 3);
  const Outcome outcome = folder.run({"mstar", "chips", "-o", "out"});
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(outcome.out.starts_with("out/dataset.json\n"));
  CHECK(has(outcome.out, "truck 1"));
  CHECK(has(outcome.out, "3 images, depression 17 deg (measured 17.10), azimuth 0.00 to 2.00 deg, "
                         "widest gap 358.00 deg "
                         "after 2.00"));
  CHECK_FALSE(read_manifest(folder / "out").exact_poses);
  const auto files = folder.contents("out");
  CHECK(files.size() == 3 + 2 * 3);
  for (const char* name :
       {"dataset.json", "recipe.json", "SHA256SUMS", "images/view_002.tif", "png/view_000.png"})
    CHECK(files.count(name) == 1);
  CHECK(std::filesystem::exists(folder / "out/dataset.report.json"));
  const Dataset d = read_manifest(folder / "out");
  CHECK(d.views[2].source == "original.000");
  CHECK(d.views[2].slant_range_m == 4475.0);
  CHECK(d.scene_box_m.max.x == scene_box_of_swath(d.aim_m, d.views).max.x);
}

TEST_CASE("sar_import has help for itself and for each command", "[import]") {
  const ChipFolder folder;
  const Outcome help = folder.run({"--help"});
  CHECK(help.code == 0);
  for (const char* piece : {"mstar", "sample", "images", "phoenix", "Exit codes"})
    CHECK(has(help.out, piece));
  const Outcome command = folder.run({"images", "--help"});
  CHECK(command.code == 0);
  for (const char* piece : {"--csv", "--every", "--crop", "[4500]", "--config"})
    CHECK(has(command.out, piece));
  CHECK(folder.run({"--version"}).out.starts_with("sar_import "));
}

TEST_CASE("the same import again is done already, damage is mended, another one refused",
          "[import]") {
  const ChipFolder folder;
  write_chips(folder, 4);
  REQUIRE(folder.run({"mstar", "chips", "-o", "out"}).code == 0);
  const auto whole = folder.contents("out");
  const Outcome again = folder.run({"mstar", "chips", "-o", "out", "--threads", "1"});
  CHECK(again.code == 0);
  CHECK(has(again.err, "already done"));
  CHECK(has(again.out, "4 images"));

  std::filesystem::resize_file(folder / "out/images/view_001.tif", 100);
  std::filesystem::remove(folder / "out/png/view_002.png");
  const Outcome mended = folder.run({"mstar", "chips", "-o", "out"});
  CHECK(has(mended.err, "continuing: 2 of 4"));
  CHECK(folder.contents("out") == whole);

  const Outcome other = folder.run({"mstar", "chips", "-o", "out", "--crop", "8"});
  CHECK(other.code == 2);
  CHECK(is_import_error(other, "choice.crop"));
  CHECK(folder.contents("out") == whole);
  CHECK(folder.run({"mstar", "chips", "-o", "out", "--every", "4", "--overwrite"}).code == 0);
  CHECK(n_images(folder / "out") == 2);

  // A chip that has changed since is another recipe, too.
  folder.write("chips/hb.0", ChipFolder::chip(0.25));
  CHECK(folder.run({"mstar", "chips", "-o", "out", "--every", "4"}).code == 2);
  write_text(folder / "file", "");
  CHECK(folder.run({"mstar", "chips", "-o", "file"}).code == 2);
  const Outcome into_itself = folder.run({"mstar", "chips", "-o", "chips"});
  CHECK(into_itself.code == 2);
  CHECK(is_import_error(into_itself, "would replace the input"));
}

TEST_CASE("a plan writes nothing", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 2);
  const Outcome plan = folder.run({"mstar", "chips", "-o", "out", "--dry-run"});
  CHECK(plan.code == 0);
  CHECK(plan.out.starts_with("plan\n"));
  CHECK(has(plan.out, "rows from far to near range"));
  CHECK_FALSE(std::filesystem::exists(folder / "out"));
  const Outcome explained = folder.run({"mstar", "chips", "-o", "out", "--explain", "-q"});
  CHECK(has(explained.err, "plan\n"));
  CHECK(n_images(folder / "out") == 2);
}

TEST_CASE("a full disk is exit code 1, and the next run continues", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 2);
  const Outcome full =
      sar_import({"mstar", "chips", "-o", "out"}, {.folder = folder.path(), .max_file_bytes = 300});
  INFO(full.err);
  CHECK(full.code == 1);
  const Outcome after = folder.run({"mstar", "chips", "-o", "out", "--overwrite"});
  INFO(after.err);
  CHECK(after.code == 0);
}

TEST_CASE("interrupted imports leave what is finished, and continue to the same bytes",
          "[import]") {
  const ChipFolder folder;
  write_chips(folder, 500);
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string name = "s" + std::to_string(signal);
    bool sent = false;  // a second signal ends the program at once
    const auto once = [&](double) {
      if (sent || n_images(folder / name) < 1) return 0;
      sent = true;
      return signal;
    };
    const Outcome outcome = sar_import({"mstar", "chips", "-o", name, "--threads", "1"}, {folder.path(), once});
    INFO(outcome.err);
    REQUIRE(outcome.code == 130);
    const std::size_t n = n_images(folder / name);
    REQUIRE(n < 500);
    const Dataset part = read_manifest(folder / name);
    CHECK(part.views.size() == n);
    CHECK(part.n_planned_views == 500);
    CHECK(folder.run({"mstar", "chips", "-o", name}).code == 0);
  }
  CHECK(folder.run({"mstar", "chips", "-o", "straight"}).code == 0);
  CHECK(folder.contents("straight") == folder.contents("s" + std::to_string(SIGINT)));
  CHECK(folder.contents("straight") == folder.contents("s" + std::to_string(SIGTERM)));
}

TEST_CASE("chips of a dataset of chips are the chips", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 3);
  REQUIRE(folder.run({"mstar", "chips", "-o", "out"}).code == 0);
  const Outcome back = folder.run({"phoenix", "out", "-o", "back"});
  INFO(back.err);
  REQUIRE(back.code == 0);
  CHECK(has(back.out, "3 Phoenix chips, chip_000.phoenix to chip_002.phoenix"));
  for (int n = 0; n < 3; ++n) {
    const PhoenixChip before = read_phoenix(folder / ("chips/hb." + std::to_string(n)));
    const PhoenixChip after =
        read_phoenix(folder / ("back/chip_00" + std::to_string(n) + ".phoenix"));
    CHECK(std::equal(before.magnitude.pixels().begin(), before.magnitude.pixels().end(),
                     after.magnitude.pixels().begin()));
    CHECK(after.target_azimuth_deg == before.target_azimuth_deg);
    CHECK(after.measured_depression_deg == Approx(*before.measured_depression_deg));
    CHECK(after.measured_range_m == before.measured_range_m);
    CHECK(after.target_type == before.target_type);
    CHECK(after.file_name == before.file_name);
  }
  CHECK(has(folder.run({"phoenix", "out", "-o", "back"}).err, "already done"));
  CHECK(folder.run({"phoenix", "out", "-o", "plan", "--dry-run"}).out.starts_with("plan\n"));
  CHECK_FALSE(std::filesystem::exists(folder / "plan"));
  // Other output is not written over.
  CHECK(folder.run({"phoenix", "out", "-o", "out"}).code == 2);
  REQUIRE(folder.run({"mstar", "chips", "-o", "two", "--every", "2"}).code == 0);
  const Outcome other = folder.run({"phoenix", "two", "-o", "back"});
  CHECK(other.code == 2);
  CHECK(is_import_error(other, "dataset_sha256"));
}

TEST_CASE("--overwrite leaves no chip of another dataset, and a damaged recipe is mended", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 4);
  REQUIRE(folder.run({"mstar", "chips", "-o", "all"}).code == 0);
  REQUIRE(folder.run({"mstar", "chips", "-o", "two", "--every", "2"}).code == 0);
  REQUIRE(folder.run({"phoenix", "two", "-o", "straight"}).code == 0);
  REQUIRE(folder.run({"phoenix", "all", "-o", "back"}).code == 0);
  REQUIRE(folder.run({"phoenix", "two", "-o", "back", "--overwrite"}).code == 0);
  const auto whole = folder.contents("straight");
  CHECK(folder.contents("back") == whole);
  for (const char* name : {"back", "two"}) {
    const auto before = folder.contents(name);
    write_text(folder / (std::string(name) + "/recipe.json"), "{");
    const Outcome mended = name == std::string("back") ? folder.run({"phoenix", "two", "-o", name})
                                                       : folder.run({"mstar", "chips", "-o", name, "--every", "2"});
    INFO(mended.err);
    CHECK(mended.code == 0);
    CHECK(folder.contents(name) == before);
  }
}

TEST_CASE("nothing is written into a folder that is read", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 2);
  const auto chips = folder.contents("chips");
  for (const char* place : {"chips/out", "chips/deep/er", "./chips/../chips/out"}) {
    const Outcome inside = folder.run({"mstar", "chips", "-o", place});
    CHECK(inside.code == 2);
    CHECK(is_import_error(inside, "lies inside the input chips"));
  }
  CHECK(folder.contents("chips") == chips);
  REQUIRE(folder.run({"mstar", "chips", "-o", "chips_out"}).code == 0);  // beside it, with the same beginning
  const Outcome phoenix = folder.run({"phoenix", "chips_out", "-o", "chips_out/phoenix"});
  CHECK(phoenix.code == 2);
  CHECK_FALSE(std::filesystem::exists(folder / "chips_out/phoenix"));
}

TEST_CASE("an import replaces none of its own pictures", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 2);
  REQUIRE(folder.run({"mstar", "chips", "-o", "out"}).code == 0);
  const auto whole = folder.contents("out");
  write_text(folder / "table.csv", "file,azimuth_deg,depression_deg\nview_000.tif,1,17\nview_001.tif,3,17\n");
  const Outcome own = folder.run({"images", "out/images", "--csv", "table.csv", "--spacing", "0.2,0.2", "-o", "out", "--overwrite"});
  CHECK(own.code == 2);
  INFO(own.err);
  CHECK(is_import_error(own, "lies in the output out"));
  CHECK(folder.contents("out") == whole);
}

TEST_CASE("Phoenix chips replace no file of another origin", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 1);
  REQUIRE(folder.run({"mstar", "chips", "-o", "out"}).code == 0);
  for (const char* name : {"SHA256SUMS", "recipe.json"}) {
    const std::filesystem::path place = folder / (std::string("of_") + name);
    std::filesystem::create_directory(place);
    write_text(place / name, "mine");
    const Outcome refused = folder.run({"phoenix", "out", "-o", place.filename().string()});
    CHECK(refused.code == 2);
    CHECK(read_text(place / name) == "mine");
  }
  std::filesystem::create_directory(folder / "mine");
  write_text(folder / "mine/chip_mine.phoenix", "mine");
  CHECK(folder.run({"phoenix", "out", "-o", "mine", "--overwrite"}).code == 0);
  CHECK(read_text(folder / "mine/chip_mine.phoenix") == "mine");
}

TEST_CASE("-q leaves the path on stdout, and one image is no images", "[import]") {
  const ChipFolder folder;
  write_chips(folder, 1);
  const Outcome quiet = folder.run({"mstar", "chips", "-o", "out", "-q"});
  CHECK(quiet.out == "out/dataset.json\n");
  CHECK(quiet.err.empty());
  CHECK(has(folder.run({"mstar", "chips", "-o", "out"}).err, "the image of the same recipe is there"));
  const Outcome chips = folder.run({"phoenix", "out", "-o", "back"});
  CHECK(has(chips.err, "finished: 1 chip\n"));
  CHECK(chips.out == "back/\n  1 Phoenix chip, chip_000.phoenix\n");
  CHECK(folder.run({"phoenix", "out", "-o", "back", "-q"}).out == "back/\n");
}
