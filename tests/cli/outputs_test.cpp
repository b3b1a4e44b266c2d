// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "catch.h"
#include "mirrored.h"
#include "program.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/manifest.h"

using namespace sarnerf;

namespace {

const std::vector<std::string> kOneView = {"box.obj", "--pitch", "45", "--azimuth", "30", "--size", "40x50"};

}  // namespace

TEST_CASE("one view: image, picture, recipe and report, their paths on stdout") {
  const SceneFolder folder;
  const Outcome outcome = folder.run(with(kOneView, {"-o", "new/deep/a"}));
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(outcome.out == "new/deep/a.tif\nnew/deep/a.png\nnew/deep/a.json\n");
  const auto files = folder.contents("new/deep");
  CHECK(files.size() == 3);
  CHECK(std::filesystem::exists(folder / "new/deep/a.report.json"));

  const Image<float> image = read_image(folder / "new/deep/a.tif");
  CHECK(image.n_azimuth() == 40);
  CHECK(image.n_range() == 50);
  const Image<float> picture = read_image(folder / "new/deep/a.png");
  CHECK(picture.n_range() == 50);
  // The corner sees nothing, the box is bright.
  CHECK(image(0, 0) == 0.0f);
  CHECK(picture(0, 0) == 0.0f);
  float brightest = 0.0f;
  for (const float p : picture.pixels()) brightest = std::max(brightest, p);
  CHECK(brightest == 255.0f);

  const std::string& recipe = files.at("a.json");
  for (const char* piece : {"\"sha256\"", "\"incidence_deg\": 45.0", "\"depression_deg\": 45.0",
                            "\"azimuth_deg\": 30.0", "\"program\": \"sar_render ", "\"elevations\""}) {
    INFO(piece);
    CHECK(has(recipe, piece));
  }
}

TEST_CASE("names: default, folder, ending") {
  const SceneFolder folder;
  std::filesystem::create_directory(folder / "there");
  CHECK(folder.run(kOneView).out.starts_with("box_sar.tif\n"));
  CHECK(folder.run(with(kOneView, {"-o", "there"})).out.starts_with("there/box_sar.tif\n"));
  CHECK(folder.run(with(kOneView, {"-o", "fresh/"})).out.starts_with("fresh/box_sar.tif\n"));
  CHECK(folder.run(with(kOneView, {"-o", "a.tif"})).out.starts_with("a.tif\na.png\n"));
  CHECK(folder.run(with(kOneView, {"-o", "v1.5"})).out.starts_with("v1.5.tif\n"));
  const Outcome quiet = folder.run(with(kOneView, {"-q", "-o", "quiet"}));
  CHECK(quiet.out == "quiet.tif\nquiet.png\nquiet.json\n");
  CHECK(quiet.err.empty());
}

TEST_CASE("the same recipe is already done, another one is refused, --overwrite replaces") {
  const SceneFolder folder;
  REQUIRE(folder.run(with(kOneView, {"-o", "a"})).code == 0);
  const auto first = folder.contents();
  const auto written = std::filesystem::last_write_time(folder / "a.tif");

  const Outcome same = folder.run(with(kOneView, {"-o", "a"}));
  CHECK(same.code == 0);
  CHECK(has(same.err, "already done"));
  CHECK(same.out == "a.tif\na.png\na.json\n");
  CHECK(std::filesystem::last_write_time(folder / "a.tif") == written);

  const Outcome other = folder.run(with(kOneView, {"-o", "a", "--spacing", "0.2"}));
  CHECK(other.code == 2);
  CHECK(is_error_line(other.err, "image.spacing_m: [0.3,0.3] there, [0.2,0.2] now"));
  CHECK(folder.contents() == first);

  // The same name, another content.
  const std::string box = read_text(folder / "box.obj");
  write_text(folder / "box.obj", box + "# changed\n");
  const Outcome changed = folder.run(with(kOneView, {"-o", "a"}));
  CHECK(changed.code == 2);
  CHECK(is_error_line(changed.err, "scene.sha256"));
  write_text(folder / "box.obj", box);

  CHECK(folder.run(with(kOneView, {"-o", "a", "--spacing", "0.2", "--overwrite"})).code == 0);
  CHECK(folder.contents() != first);
  CHECK(folder.run(with(kOneView, {"-o", "a", "--overwrite"})).code == 0);
  CHECK(folder.contents() == first);

  // A picture that was lost is made again.
  std::filesystem::remove(folder / "a.png");
  CHECK(folder.run(with(kOneView, {"-o", "a"})).code == 0);
  CHECK(folder.contents() == first);
}

TEST_CASE("files of unknown origin and inputs are not replaced") {
  const SceneFolder folder;
  write_text(folder / "a.png", "somebody's");
  CHECK(folder.run(with(kOneView, {"-o", "a"})).code == 2);
  CHECK(read_text(folder / "a.png") == "somebody's");

  write_text(folder / "scene.json",
             R"({"format":"sarnerf-scene","version":1,"meshes":[{"file":"box.obj"}]})");
  const Outcome outcome = folder.run({"scene.json", "--pitch", "45", "-o", "scene", "--overwrite"});
  INFO(outcome.err);
  CHECK(outcome.code == 2);
  CHECK(is_error_line(outcome.err, "replace the input"));
  CHECK(read_text(folder / "scene.json").starts_with("{\"format\""));
}

TEST_CASE("a mesh that a scene file names is part of its recipe") {
  const SceneFolder folder;
  write_text(folder / "scene.json",
             R"({"format":"sarnerf-scene","version":1,"meshes":[{"file":"box.obj"}]})");
  REQUIRE(folder.run({"scene.json", "--pitch", "45", "-q"}).code == 0);
  CHECK(has(folder.run({"scene.json", "--pitch", "45"}).err, "already done"));
  write_text(folder / "box.obj", read_text(folder / "box.obj") + "# changed\n");
  const Outcome changed = folder.run({"scene.json", "--pitch", "45", "-q"});
  CHECK(changed.code == 2);
  CHECK(is_error_line(changed.err, "resolved.inputs"));
}

TEST_CASE("the same bytes whatever the threads") {
  const SceneFolder folder;
  for (const char* threads : {"1", "2", "3"}) {
    CHECK(folder.run(with(kOneView, {"-q", "--threads", threads, "-o", std::string(threads) + "/a"})).code ==
          0);
  }
  CHECK(folder.contents("1") == folder.contents("2"));
  CHECK(folder.contents("1") == folder.contents("3"));
}

TEST_CASE("the plan: printed before the work, or instead of it") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Outcome dry = folder.run(with(kOneView, {"--dry-run"}));
  CHECK(dry.code == 0);
  for (const char* piece : {"scene", "rays", "memory", "time", "left out", "40 x 50 pixels", "box_sar"}) {
    INFO(piece);
    CHECK(has(dry.out, piece));
  }
  CHECK(folder.contents() == before);

  const Outcome explained = folder.run(with(kOneView, {"--explain", "-q"}));
  CHECK(explained.code == 0);
  CHECK(has(explained.err, "left out"));
  CHECK(explained.out == "box_sar.tif\nbox_sar.png\nbox_sar.json\n");
}

TEST_CASE("a blank image says why") {
  const SceneFolder folder;
  const Outcome outcome = folder.run(with(kOneView, {"--aim", "500,0,0", "-q"}));
  CHECK(outcome.code == 0);
  CHECK(has(outcome.err, "warning: "));
  CHECK(has(outcome.err, "swath"));
  // The rendered swath is wider by the reach of an impulse response; the warning is of the image's.
  const Outcome wide = folder.run(with(kOneView, {"--aim", "500,0,0", "-q", "--resolution", "0.5", "-o", "wide"}));
  CHECK(std::ranges::count(wide.err, '\n') == 1);
  CHECK(wide.err.substr(wide.err.find("the image ends")) == outcome.err.substr(outcome.err.find("the image ends")));
}

TEST_CASE("looking left, the radar flies the other way: the same image with its rows reversed") {
  const SceneFolder folder;
  REQUIRE(folder.run(with(kOneView, {"-q", "-o", "right"})).code == 0);
  REQUIRE(folder.run(with(kOneView, {"--look", "left", "-q", "-o", "left"})).code == 0);
  const Image<float> right = read_image(folder / "right.tif"), left = read_image(folder / "left.tif");
  CHECK(relative_l2_error(left, rows_reversed(right)) < 0.03);
  CHECK(relative_l2_error(left, right) > 0.3);
  REQUIRE(folder.run({"box.obj", "--pitch", "45", "--azimuth", "0,30", "--look", "left", "--size", "24x24", "-q", "-o", "sweep"}).code == 0);
  for (const DatasetView& view : read_manifest(folder / "sweep").views) CHECK(view.look == Look::left);
}
