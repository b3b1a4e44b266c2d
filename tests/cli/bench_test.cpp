// SPDX-License-Identifier: Apache-2.0
// sar_bench's command line; what it measures is no matter of tests.
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>

#include "catch.h"
#include "program.h"
#include "sarnerf/core/files.h"
#include "sarnerf/dataset/image_file.h"

TEST_CASE("sar_bench names the study that it does not know") {
  const SceneFolder folder;
  const Conditions here{folder.path()};
  const Outcome unknown = sar_bench({"nope"}, here), near = sar_bench({"sped"}, here), none = sar_bench({}, here);
  CHECK(unknown.code == 2);
  CHECK(has(unknown.err, "expected a study (speed, accuracy, voxel, extraction, learning, scenes, page, curves, strip, extents, ablation), found 'nope'"));
  CHECK(has(near.err, "(speed?)"));
  CHECK(none.code == 2);
  const Outcome option = sar_bench({"speed", "--round", "5"}, here);
  CHECK(option.code == 2);
  CHECK(has(option.err, "--round"));
}

TEST_CASE("sar_bench: help without inner names of types, a full stdout is a failure") {
  const SceneFolder folder;
  const Outcome help = sar_bench({"speed", "--help"}, {folder.path()});
  CHECK(help.code == 0);
  CHECK(has(help.out, "--rounds"));
  CHECK_FALSE(has(help.out, "POSITIVE"));
  CHECK_FALSE(has(help.out, "INT"));
  const Outcome full = sar_bench({"speed", "--help"}, {.folder = folder.path(), .out = "/dev/full"});
  CHECK(full.code == 1);
  CHECK(has(full.err, "stdout"));
}

TEST_CASE("sar_bench does not replace what it measures, and says so before it measures") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Conditions here{folder.path()};
  const Outcome outcome = sar_bench({"accuracy", "box.obj", "--json", "box.obj"}, here);
  CHECK(outcome.code == 2);
  CHECK(has(outcome.err, "would replace"));
  CHECK(sar_bench({"accuracy", "box.obj", "--json", "absent/result.json"}, here).code == 1);
  CHECK(sar_bench({"accuracy", "absent.obj"}, here).code == 3);
  CHECK(folder.contents() == before);
}

TEST_CASE("sar_bench --dry-run says what it would measure, and measures nothing") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Conditions here{folder.path()};
  const Outcome speed = sar_bench({"speed", "box.obj", "--dry-run", "--json", "r.json", "--rounds", "7"}, here);
  CHECK(speed.code == 0);
  for (const char* piece : {"plan\n", "study      speed", "scene      box.obj", "7 of each contender", "360-view sweeps", "output     r.json"})
    CHECK(has(speed.out, piece));
  CHECK(has(sar_bench({"speed", "--quick", "--dry-run"}, here).out, "generated spheres"));
  CHECK_FALSE(has(sar_bench({"speed", "--quick", "--dry-run"}, here).out, "sweeps"));
  CHECK(has(sar_bench({"accuracy", "box.obj", "--dry-run", "--pitch", "30"}, here).out, "incidence 30 deg"));
  CHECK(has(sar_bench({"voxel", "box.obj", "--dry-run"}, here).out, "study      voxel"));
  CHECK(sar_bench({"accuracy", "absent.obj", "--dry-run"}, here).code == 3);
  const Outcome loop = sar_bench({"extraction", "box.obj", "--views", "12,36x11", "--time", "2s", "--seeds", "3", "--dry-run"}, here);
  INFO(loop.err);
  CHECK(loop.code == 0);
  CHECK(has(loop.out, "views      12, 36x11"));
  CHECK(has(loop.out, "6 runs"));
  CHECK(folder.contents() == before);
}

TEST_CASE("sar_bench scenes: a folder for each seed, the same bytes again, other scenes refused") {
  const SceneFolder folder;
  const Conditions here{folder.path()};
  const std::vector<std::string> two = {"scenes", "--seed", "101,103", "-o", "out"};
  const Outcome first = sar_bench(two, here);
  INFO(first.err);
  CHECK(first.code == 0);
  CHECK(first.out == "out/101_solid/scene.json\nout/103_vehicle/scene.json\n");
  CHECK(has(first.err, "103_vehicle: "));
  const auto before = folder.contents();
  CHECK(before.size() == 6);

  const Outcome again = sar_bench({"scenes", "--seed", "101:103", "-o", "out/", "-q"}, here);
  CHECK(again.code == 0);
  CHECK(again.out == "out/101_solid/scene.json\nout/102_building/scene.json\nout/103_vehicle/scene.json\n");
  CHECK(again.err.empty());
  CHECK(folder.run({"out/102_building/scene.json", "--pitch", "45", "--size", "32x32", "-o", "view"}).code == 0);

  write_text(folder / "out/103_vehicle/scene.json", "{}");
  const Outcome refused = sar_bench({"scenes", "--seed", "103:104", "-o", "out"}, here);
  CHECK(refused.code == 2);
  CHECK(has(refused.err, "out/103_vehicle/scene.json: another scene is in the way"));
  CHECK_FALSE(std::filesystem::exists(folder / "out/104_free_form"));
  CHECK(sar_bench({"scenes", "--seed", "103", "-o", "out", "--overwrite"}, here).code == 0);
  for (const auto& [name, text] : before) CHECK(folder.contents().at(name) == text);
}

TEST_CASE("sar_bench scenes --dry-run writes nothing; seeds that are none, and places that are no folder, are refused") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Conditions here{folder.path()};
  const Outcome plan = sar_bench({"scenes", "--seed", "101:104", "-o", "out", "--dry-run"}, here);
  CHECK(plan.code == 0);
  CHECK(has(plan.out, "scene      104_free_form: "));
  CHECK(has(plan.out, "output     out/104_free_form/scene.json"));
  for (const char* seeds : {"x", "1.5", "-1", "101:", "101:x", "101,,102", "109:101", "1:2:3", "0:999999999"}) {
    INFO(seeds);
    const Outcome outcome = sar_bench({"scenes", "--seed=" + std::string(seeds), "-o", "out"}, here);
    CHECK(outcome.code == 2);
    CHECK(has(outcome.err, "--seed"));
  }
  CHECK(sar_bench({"scenes", "--seed", "101"}, here).code == 2);
  CHECK(sar_bench({"scenes", "-o", "out"}, here).code == 2);
  CHECK(has(sar_bench({"scenes", "--seed", "101", "-o", "box.obj"}, here).err, "found a file"));
  CHECK(folder.contents() == before);
}

TEST_CASE("sar_bench strip puts views of datasets side by side, and page makes one file of Markdown and its pictures") {
  const SceneFolder folder;
  const Conditions here{folder.path()};
  for (const char* name : {"a", "b"})
    REQUIRE(sar_render({"box.obj", "--pitch", "45", "--size", "16x24", "--azimuth", "0:40:40", "-o", name, "-q"}, here).code == 0);
  REQUIRE(sar_render({"box.obj", "--pitch", "45", "--size", "16x24", "--azimuth", "40:80:40", "-o", "one", "-q"}, here).code == 0);
  const Outcome strip = sar_bench({"strip", "a", "b", "--trained", "one", "--zoom", "2", "-o", "strip.png"}, here);
  CHECK(strip.code == 0);
  CHECK(strip.out == "strip.png\n");
  const sarnerf::Image<sarnerf::Colour> picture = sarnerf::read_picture(folder.path() / "strip.png");
  // Two rows of two views of 32 x 48 pixels in frames of 3; the view at 40 degrees has a red one.
  CHECK(picture.n_azimuth() == 2 * 38);
  CHECK(picture.n_range() == 2 * 54);
  CHECK(picture(1, 1) == sarnerf::Colour{255, 255, 255});
  CHECK(picture(1, 56)[0] > 200);
  CHECK(picture(1, 56)[1] < 100);
  std::set<sarnerf::Colour> colours;
  for (int column = 0; column < picture.n_range(); ++column) {
    CHECK(picture(10, column) == picture(48, column));
    colours.insert(picture(10, column));
  }
  CHECK(colours.size() > 5);  // an image, not an empty frame
  // A dataset of predictions may lack a view that was trained on: its place stays white. The difference of a view from itself is black.
  CHECK(sar_bench({"strip", "a", "b", "--difference", "-o", "three.png"}, here).code == 0);
  const sarnerf::Image<sarnerf::Colour> three = sarnerf::read_picture(folder.path() / "three.png");
  REQUIRE(three.n_azimuth() == 3 * 22);
  CHECK(three(2 * 22 + 10, 20) == sarnerf::Colour{0, 0, 0});
  CHECK(sar_bench({"strip", "a", "one", "--trained", "a", "-o", "gap.png"}, here).code == 0);
  CHECK(sarnerf::read_picture(folder.path() / "gap.png")(22 + 10, 10) == sarnerf::Colour{255, 255, 255});
  const Outcome alone = sar_bench({"strip", "a", "--difference", "-o", "no.png"}, here);
  CHECK(alone.code == 2);
  CHECK(has(alone.err, "--difference: expected two datasets or more"));
  const Outcome missing = sar_bench({"strip", "a", "one", "-o", "no.png"}, here);
  CHECK(missing.code == 2);
  CHECK(has(missing.err, "one: expected a view at azimuth 0"));

  sarnerf::write_file_atomically(folder.path() / "r.md", "# Result\n\n![two views](strip.png)\n\n| a | b |\n|---|--:|\n| x | 1.5 |\n");
  const Outcome page = sar_bench({"page", "r.md"}, here);
  CHECK(page.code == 0);
  CHECK(page.out == "r.html\n");
  const std::string html = sarnerf::read_whole_file(folder.path() / "r.html");
  for (const char* piece : {"<title>Result", "data:image/png;base64,", "1.5"}) CHECK(has(html, piece));
  sarnerf::write_file_atomically(folder.path() / "r.md", "![gone](gone.png)\n");
  const Outcome gone = sar_bench({"page", "r.md"}, here);
  CHECK(gone.code == 3);
  CHECK(has(gone.err, "gone.png"));
  CHECK(sar_bench({"page", "r.md", "-o", "r.md"}, here).code == 2);
}

TEST_CASE("sar_bench extents measures wall, roof and shadow of a box along the middle row") {
  const SceneFolder folder;
  const Conditions here{folder.path()};
  for (const char* name : {"a", "b"})
    REQUIRE(sar_render({"box.obj", "--pitch", "45", "--size", "32x256", "--spacing", "0.05", "--azimuth", "0,180", "--slant-range", "1e6", "--ground",
                        "grass", "--layers", "wall,roof,mask", "-o", name, "-q"}, here).code == 0);
  const Outcome outcome = sar_bench({"extents", "a", "b"}, here);
  CHECK(outcome.code == 0);
  // From azimuth 0 the box is 2 m deep and 3 m high: the wall has 3 cos 45°, the roof 2 sin 45°, the shadow what of 5 sin 45° is behind its foot.
  std::istringstream lines(outcome.out);
  std::string line;
  for (int n = 0; n < 2; ++n) std::getline(lines, line);
  for (int n = 0; n < 4; ++n) {
    REQUIRE(std::getline(lines, line));
    CAPTURE(line);
    double wall = 0.0, roof = 0.0, shadow = 0.0;
    REQUIRE(std::sscanf(line.c_str(), "| %*s | %*s | %lf | %lf | %lf |", &wall, &roof, &shadow) == 3);
    CHECK(std::abs(wall - 3.0 * std::sqrt(0.5)) < 0.051);
    CHECK(std::abs(roof - 2.0 * std::sqrt(0.5)) < 0.051);
    CHECK(std::abs(shadow - 5.0 * std::sqrt(0.5)) < 0.101);
    CHECK(has(line, n < 2 ? "| – |" : "0.00 %"));
  }
  REQUIRE(sar_render({"box.obj", "--pitch", "45", "--size", "16x24", "--azimuth", "0,180", "-o", "bare", "-q"}, here).code == 0);
  CHECK(has(sar_bench({"extents", "bare"}, here).out, "| – | – | – | – |"));
}

TEST_CASE("sar_bench curves prints the mean of runs after halves of the longest time") {
  const SceneFolder folder;
  const Conditions here{folder.path()};
  const auto write = [&](const char* run, const std::string& text) {
    std::filesystem::create_directories(folder.path() / run);
    sarnerf::write_file_atomically(folder.path() / run / "metrics.jsonl", text);
  };
  // PSNR 10 + 10 log2(seconds), and 2 dB more; lines without a score, and half a line at the end, count for nothing.
  write("a", "{\"step\":1,\"seconds\":1.0,\"loss\":1.0,\"psnr_power_db\":10.0}\n{\"step\":2,\"seconds\":2.0,\"loss\":1.0}\n"
             "{\"step\":8,\"seconds\":8.0,\"psnr_power_db\":40.0}\n{\"step\":9,\"sec");
  write("b", "{\"step\":1,\"seconds\":1.0,\"psnr_power_db\":12.0}\n{\"step\":4,\"seconds\":8.0,\"psnr_power_db\":42.0}\n");
  write("none", "{\"step\":1,\"seconds\":1.0,\"loss\":1.0}\n");
  const Outcome outcome = sar_bench({"curves", "ours=a,b", "-o", "c.png"}, here);
  CHECK(outcome.code == 0);
  for (const char* piece : {" 2 s |", " 8 s |", "21.00 (20.00 to 22.00)", "31.00 (30.00 to 32.00)", "41.00 (40.00 to 42.00)", "| ours "})
    CHECK(has(outcome.out, piece));
  CHECK(sarnerf::read_picture(folder.path() / "c.png").n_range() > 100);
  CHECK(has(sar_bench({"curves", "ours=b", "--steps"}, here).out, "4 steps"));
  const Outcome none = sar_bench({"curves", "ours=none"}, here);
  CHECK(none.code == 3);
  CHECK(has(none.err, "expected held-out PSNR, found none"));
  CHECK(sar_bench({"curves", "ours"}, here).code == 2);
}
