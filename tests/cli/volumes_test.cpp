// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <iterator>

#include "catch.h"
#include "program.h"

namespace {

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("a mesh saved as voxels renders to the same image from its file") {
  const SceneFolder folder;
  const Outcome made = folder.run({"box.obj", "--pitch", "45", "--azimuth", "20", "--engine", "voxel",
                                   "--save-volume", "box.vdb", "-o", "made"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK(made.out == "made.tif\nmade.png\nmade.json\n");
  const Outcome again = folder.run({"box.vdb", "--pitch", "45", "--azimuth", "20", "-o", "again"});
  INFO(again.err);
  REQUIRE(again.code == 0);
  CHECK(bytes_of(folder / "made.tif") == bytes_of(folder / "again.tif"));
  // The ground of a volume obeys the rules of a mesh's.
  for (const auto& [material, piece] : {std::pair{"canopy", "translucent"}, std::pair{"nope", "unknown material 'nope'"}}) {
    const Outcome refused = folder.run({"box.vdb", "--pitch", "45", "--ground", material, "-o", "ground"});
    CHECK(refused.code == 2);
    CHECK(is_error_line(refused.err, piece));
  }
}

TEST_CASE("volumes are not replaced unasked, and refuse what only meshes take") {
  const SceneFolder folder;
  REQUIRE(folder.run({"box.obj", "--pitch", "45", "--engine", "voxel", "--save-volume", "box.vdb"}).code == 0);
  const std::string before = bytes_of(folder / "box.vdb");
  const Outcome twice = folder.run(
      {"box.obj", "--pitch", "35", "--engine", "voxel", "--save-volume", "box.vdb", "-o", "other"});
  CHECK(twice.code == 2);
  CHECK(bytes_of(folder / "box.vdb") == before);
  // The same command again finds its own volume, and no other.
  const std::vector<std::string> same{"box.obj", "--pitch", "45", "--engine", "voxel", "--save-volume", "box.vdb", "-q"};
  CHECK(folder.run(same).code == 0);
  CHECK(bytes_of(folder / "box.vdb") == before);
  write_text(folder / "box.vdb", before + "more");
  const Outcome foreign = folder.run(same);
  CHECK(foreign.code == 2);
  CHECK(is_error_line(foreign.err, "other voxels"));
  CHECK(bytes_of(folder / "box.vdb") == before + "more");
  CHECK(folder.contents().count("box.vdb.again") == 0);
  write_text(folder / "box.vdb", before);
  CHECK(folder.run({"box.vdb", "--pitch", "45", "--engine", "surface"}).code == 2);
  CHECK(folder.run({"box.vdb", "--pitch", "45", "--voxel-size", "1"}).code == 2);
  write_text(folder / "bad.vdb", before.substr(0, before.size() / 2));
  const Outcome truncated = folder.run({"bad.vdb", "--pitch", "45"});
  CHECK(truncated.code == 3);
  CHECK(is_error_line(truncated.err, "bad.vdb"));
}

TEST_CASE("a single view is not written into a sweep's dataset") {
  const SceneFolder folder;
  REQUIRE(folder.run({"box.obj", "--pitch", "45", "--azimuth", "0:90:45", "-o", "sweep"}).code == 0);
  const auto before = folder.contents();
  const Outcome single = folder.run({"box.obj", "--pitch", "30", "-o", "sweep"});
  CHECK(single.code == 2);
  CHECK(is_error_line(single.err, "sweep"));
  CHECK(folder.contents() == before);
}
