// SPDX-License-Identifier: Apache-2.0
// sar_bench's command line; what it measures is no matter of tests.
#include "catch.h"
#include "program.h"

namespace {

bool has(const std::string& text, const std::string& piece) { return text.find(piece) != std::string::npos; }

}  // namespace

TEST_CASE("sar_bench names the study that it does not know") {
  const SceneFolder folder;
  const Conditions here{folder.path(), 0, {}, {}, {}};
  const Outcome unknown = sar_bench({"nope"}, here), near = sar_bench({"sped"}, here), none = sar_bench({}, here);
  CHECK(unknown.code == 2);
  CHECK(has(unknown.err, "expected a study (speed, accuracy, voxel, extraction, learning), found 'nope'"));
  CHECK(has(near.err, "(speed?)"));
  CHECK(none.code == 2);
  const Outcome option = sar_bench({"speed", "--round", "5"}, here);
  CHECK(option.code == 2);
  CHECK(has(option.err, "--round"));
}

TEST_CASE("sar_bench: help without inner names of types, a full stdout is a failure") {
  const SceneFolder folder;
  const Outcome help = sar_bench({"speed", "--help"}, {folder.path(), 0, {}, {}, {}});
  CHECK(help.code == 0);
  CHECK(has(help.out, "--rounds"));
  CHECK_FALSE(has(help.out, "POSITIVE"));
  CHECK_FALSE(has(help.out, "INT"));
  const Outcome full = sar_bench({"speed", "--help"}, {folder.path(), 0, "/dev/full", {}, {}});
  CHECK(full.code == 1);
  CHECK(has(full.err, "stdout"));
}

TEST_CASE("sar_bench does not replace what it measures, and says so before it measures") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Conditions here{folder.path(), 0, {}, {}, {}};
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
  const Conditions here{folder.path(), 0, {}, {}, {}};
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
