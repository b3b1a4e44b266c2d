// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <csignal>

#include "catch.h"
#include "program.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/dataset/manifest.h"

using namespace sarnerf;

namespace {

std::vector<std::string> sweep(const std::string& output, const std::vector<std::string>& more = {}) {
  return with({"box.obj", "--pitch", "35,50", "--azimuth", "0:330:30", "--size", "24x32", "--spacing", "0.5", "-o", output}, more);
}

}  // namespace

TEST_CASE("a sweep is a dataset of every combination") {
  const SceneFolder folder;
  const Outcome outcome = folder.run(sweep("s"));
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(outcome.out == "s/dataset.json\n");
  const Dataset dataset = read_manifest(folder / "s");
  REQUIRE(dataset.views.size() == 24);
  CHECK(dataset.quantity == Quantity::power);
  CHECK(dataset.calibration == Calibration::beta0);
  CHECK(dataset.exact_poses);
  CHECK(dataset.views[0].incidence_deg == 35.0);
  CHECK(dataset.views[11].azimuth_deg == 330.0);
  CHECK(dataset.views[12].incidence_deg == 50.0);
  CHECK(dataset.views[12].altitude_m == 10000.0);
  CHECK(dataset.scene_box_m.max.y ==
        scene_box_of_swath(dataset.aim_m, dataset.views).max.y);
  for (const DatasetView& view : dataset.views) {
    const Image<float> image = read_image(folder / "s" / view.image);
    CHECK(image.n_azimuth() == 24);
    CHECK(image.n_range() == 32);
    CHECK(std::any_of(image.pixels().begin(), image.pixels().end(), [](float p) { return p > 0; }));
  }
  CHECK(folder.contents("s").size() == 3 + 2 * 24);
  CHECK(std::filesystem::exists(folder / "s/dataset.report.json"));

  // One of its views alone is the same image.
  CHECK(folder.run({"box.obj", "--pitch", "50", "--azimuth", "30", "--size", "24x32", "--spacing", "0.5",
                    "-q", "-o", "one"}).code == 0);
  CHECK(read_text(folder / "one.tif") == read_text(folder / "s/images/view_013.tif"));
}

TEST_CASE("a direction given twice is rendered once, and pointed out") {
  const SceneFolder folder;
  const auto run = [&](const std::vector<std::string>& angles, const std::string& name) {
    std::vector<std::string> all = {"box.obj", "--size", "8x8", "-q", "-o", name};
    all.insert(all.end(), angles.begin(), angles.end());
    return folder.run(all);
  };
  const Outcome turn = run({"--pitch", "45", "--azimuth", "0:360:90"}, "turn");
  CHECK(turn.code == 0);
  CHECK(has(turn.err, "--azimuth: 0 and 360 degrees are the same direction; it is taken once\n"));
  CHECK(read_manifest(folder / "turn").views.size() == 4);
  const Outcome twice = run({"--pitch", "45,45,30,45", "--azimuth", "0,90"}, "twice");
  CHECK(has(twice.err, "--pitch: 45 and 45 degrees are the same direction; it is taken once, and so is 1 other\n"));
  CHECK(read_manifest(folder / "twice").views.size() == 4);
  const Outcome one = run({"--depression", "17,17"}, "one");
  CHECK(has(one.err, "--depression: 17 and 17 degrees"));
  CHECK(std::filesystem::exists(folder / "one.tif"));
}

TEST_CASE("a damaged or lost recipe is mended, and does not let another one in") {
  const SceneFolder folder;
  REQUIRE(folder.run(sweep("s")).code == 0);
  const auto whole = folder.contents("s");
  CHECK(has(whole.at("SHA256SUMS"), "  recipe.json\n"));
  const std::string recipe = whole.at("recipe.json");
  std::string other_figure = recipe;
  other_figure.replace(other_figure.find("0.5"), 3, "0.7");
  const std::vector<std::string> another = {"box.obj", "--pitch", "35", "--azimuth", "0:90:30", "--size", "24x32", "-o", "s"};
  for (const std::string& damage : {std::string(), recipe.substr(0, recipe.size() / 2), other_figure, std::string("lost")}) {
    write_text(folder / "s/recipe.json", damage);
    if (damage == "lost") std::filesystem::remove(folder / "s/recipe.json");
    std::filesystem::remove(folder / "s/images/view_003.tif");
    const Outcome refused = folder.run(another);
    INFO(damage.substr(0, 60) << ": " << refused.err);
    CHECK(refused.code == 2);
    CHECK(is_error_line(refused.err.substr(refused.err.find("sar_render: error")), "other output is in the way (recipe.json is damaged"));
    const Outcome mended = folder.run(sweep("s"));
    INFO(mended.err);
    CHECK(mended.code == 0);
    CHECK(has(mended.err, "continuing: 23 of 24 views are there"));
    CHECK(folder.contents("s") == whole);
  }
  // Without the list nobody knows whose the recipe was.
  std::filesystem::remove(folder / "s/SHA256SUMS");
  std::filesystem::remove(folder / "s/recipe.json");
  CHECK(folder.run(sweep("s")).code == 2);
  CHECK(n_images(folder / "s") == 24);
}

TEST_CASE("a sweep does not depend on threads, nor on how its views share them") {
  const SceneFolder folder;
  CHECK(folder.run(sweep("a", {"--threads", "1"})).code == 0);
  CHECK(folder.run(sweep("b", {"--threads", "2"})).code == 0);
  // More threads than half the views: all threads on one view after the other.
  CHECK(folder.run(sweep("c", {"--threads", "20"})).code == 0);
  CHECK(folder.contents("a") == folder.contents("b"));
  CHECK(folder.contents("a") == folder.contents("c"));
}

TEST_CASE("views that are there are kept, damaged and missing ones made again") {
  const SceneFolder folder;
  REQUIRE(folder.run(sweep("s")).code == 0);
  const auto whole = folder.contents("s");
  const auto kept = std::filesystem::last_write_time(folder / "s/images/view_004.tif");

  const Outcome done = folder.run(sweep("s"));
  CHECK(done.code == 0);
  CHECK(has(done.err, "already done"));

  std::filesystem::remove(folder / "s/images/view_003.tif");
  std::filesystem::remove(folder / "s/png/view_007.png");
  std::filesystem::resize_file(folder / "s/images/view_010.tif", 1000);
  write_text(folder / "s/images/.view_011.tif.123-4.partial", "left by a killed process");
  const Outcome again = folder.run(sweep("s"));
  CHECK(again.code == 0);
  CHECK(has(again.err, "21 of 24"));
  CHECK(folder.contents("s") == whole);
  CHECK(std::filesystem::last_write_time(folder / "s/images/view_004.tif") == kept);
}

TEST_CASE("views that are changed or exchanged, but well-formed, are made again") {
  const SceneFolder folder;
  REQUIRE(folder.run(sweep("s", {"--layers", "wall"})).code == 0);
  const auto whole = folder.contents("s");
  const auto swap_files = [&](const char* a, const char* b) {
    std::filesystem::rename(folder / a, folder / "swap");
    std::filesystem::rename(folder / b, folder / a);
    std::filesystem::rename(folder / "swap", folder / b);
  };
  const auto change_last_byte = [&](const char* name) {
    std::string bytes = read_text(folder / name);
    bytes.back() = static_cast<char>(bytes.back() ^ 1);
    write_text(folder / name, bytes);
  };
  swap_files("s/images/view_001.tif", "s/images/view_002.tif");
  swap_files("s/png/view_005.png", "s/png/view_006.png");
  change_last_byte("s/images/view_009.tif");
  change_last_byte("s/layers/view_012.wall.tif");
  CHECK(read_image(folder / "s/images/view_001.tif").n_range() == 32);  // well-formed
  const Outcome again = folder.run(sweep("s", {"--layers", "wall"}));
  INFO(again.err);
  CHECK(again.code == 0);
  CHECK(has(again.err, "18 of 24"));
  CHECK(folder.contents("s") == whole);

  // Without the list nothing is known to be finished; a line cut off does not count, nor does noise.
  const std::string list = whole.at("SHA256SUMS");
  CHECK(has(list, "  images/view_013.tif\n"));
  const std::string views = list.substr(0, list.rfind('\n', list.size() - 2) + 1);  // the recipe is last
  write_text(folder / "s/SHA256SUMS", "noise\n" + views.substr(0, views.size() - 10));
  CHECK(has(folder.run(sweep("s", {"--layers", "wall"})).err, "23 of 24"));
  CHECK(folder.contents("s") == whole);
  std::filesystem::remove(folder / "s/SHA256SUMS");
  CHECK(folder.run(sweep("s", {"--layers", "wall"})).code == 0);
  CHECK(folder.contents("s") == whole);
}

TEST_CASE("another recipe is refused by name, --overwrite leaves nothing of the old one") {
  const SceneFolder folder;
  REQUIRE(folder.run(sweep("s")).code == 0);
  write_text(folder / "s/notes.txt", "mine");
  const auto before = folder.contents("s");
  const std::vector<std::string> other = {"box.obj", "--pitch", "35",  "--azimuth", "0:90:30", "--size",
                                          "24x32",   "-o",      "s"};
  const Outcome refused = folder.run(other);
  CHECK(refused.code == 2);
  CHECK(is_error_line(refused.err, "views.incidence_deg: [35.0,50.0] there, [35.0] now"));
  CHECK(folder.contents("s") == before);

  auto overwrite = other;
  overwrite.push_back("--overwrite");
  CHECK(folder.run(overwrite).code == 0);
  CHECK(folder.contents("s").size() == 3 + 2 * 4 + 1);
  CHECK(read_text(folder / "s/notes.txt") == "mine");

  std::filesystem::create_directories(folder / "foreign/images");
  CHECK(folder.run(sweep("foreign")).code == 2);
}

TEST_CASE("interrupted, a sweep keeps its finished views and continues to the same bytes") {
  const SceneFolder folder;
  const auto slow = [](const std::string& output) {
    return std::vector<std::string>{"box.obj", "--pitch", "45",           "--azimuth", "0:299:1", "--size",
                                    "32x32",   "-o",      output,         "--elevations", "3000"};
  };
  for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
    const std::string name = "s" + std::to_string(signal);
    bool sent = false;
    const auto when_some_are_there = [&](double) {
      if (sent || n_images(folder / name) < 5) return 0;
      sent = true;
      return signal;
    };
    const Outcome outcome = sar_render(slow(name), {folder.path(), when_some_are_there});
    INFO(outcome.err);
    CHECK(outcome.out.empty());
    if (signal == SIGKILL) {
      REQUIRE(outcome.code == -SIGKILL);
      std::string why;
      try {
        (void)read_manifest(folder / name);
      } catch (const InputError& error) {
        why = error.what();
      }
      CHECK(has(why, "stopped before it wrote its manifest"));
      CHECK(has(why, "repeat its command"));
      CHECK(folder.run(slow(name)).code == 0);
      continue;
    }
    REQUIRE(outcome.code == 130);
    CHECK(has(outcome.err, "the same command continues"));
    const Dataset partial = read_manifest(folder / name);
    CHECK(partial.views.size() == n_images(folder / name));
    CHECK(partial.views.size() < 300);
    CHECK(partial.n_planned_views == 300);
    CHECK(partial.unfinished());
    for (const DatasetView& view : partial.views) {
      CHECK(read_image(folder / name / view.image).n_range() == 32);
    }
    const auto kept = folder.contents(name);

    CHECK(folder.run(slow(name)).code == 0);
    const auto whole = folder.contents(name);
    for (const auto& [path, bytes] : kept) {
      if (path != "dataset.json" && path != "SHA256SUMS") CHECK(whole.at(path) == bytes);
    }
  }
  CHECK(folder.run(slow("straight")).code == 0);
  CHECK(folder.contents("straight") == folder.contents("s" + std::to_string(SIGINT)));
  CHECK(folder.contents("straight") == folder.contents("s" + std::to_string(SIGTERM)));
  CHECK(folder.contents("straight") == folder.contents("s" + std::to_string(SIGKILL)));
  CHECK_FALSE(read_manifest(folder / "straight").unfinished());
}

TEST_CASE("interrupted before anything is finished, nothing of a single view is left") {
  const SceneFolder folder;
  const auto before = folder.contents();
  int asked = 0;
  // Late enough for the handler to stand, early enough for a view of minutes.
  const auto soon = [&](double) { return ++asked == 1500 ? SIGINT : 0; };
  const Outcome outcome =
      sar_render({"box.obj", "--pitch", "45", "--size", "2000x2000", "--spacing", "0.01", "--sub-rows",
                  "64", "--elevations", "20000"},
                 {folder.path(), soon});
  INFO(outcome.err);
  CHECK(outcome.code == 130);
  CHECK(folder.contents() == before);
}
