// SPDX-License-Identifier: Apache-2.0
// What a user is told, once and in few words.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "catch.h"
#include "console.h"
#include "program.h"
#include "sarnerf/dataset/image_file.h"

namespace {

int n_lines(const std::string& text) { return static_cast<int>(std::count(text.begin(), text.end(), '\n')); }

std::vector<std::string> view(const std::vector<std::string>& more) {
  return with({"box.obj", "--pitch", "45", "--size", "48x48"}, more);
}

}  // namespace

TEST_CASE("rates of progress are those of the work done here, other stages included") {
  sarnerf::app::StageRates rates;
  const auto after_s = [start = sarnerf::app::StageRates::Clock::now()](int seconds) { return start + std::chrono::seconds(seconds); };
  CHECK(rates.rate("steps", 5000, after_s(0)) == 0.0);  // of an earlier run
  CHECK(rates.rate("steps", 5040, after_s(10)) == 4.0);
  CHECK(rates.rate("fields", 1, after_s(10)) == 0.0);
  CHECK(rates.rate("fields", 2, after_s(20)) == 0.1);
  rates.end("fields");
  CHECK(rates.rate("steps", 5080, after_s(40)) == 2.0);
  CHECK(rates.rate("fields", 1, after_s(50)) == 0.0);
  // Rows of the next view.
  CHECK(rates.rate("steps", 10, after_s(60)) == 0.0);
  CHECK(rates.rate("steps", 30, after_s(70)) == 2.0);
}

TEST_CASE("a single view does not go into the folder of a sweep unasked") {
  const SceneFolder folder;
  REQUIRE(folder.run(view({"--azimuth", "0,90", "-o", "sweep"})).code == 0);
  const auto before = folder.contents();
  const Outcome outcome = folder.run(view({"-o", "sweep"}));
  CHECK(outcome.code == 2);
  CHECK(is_error_line(outcome.err, "sweep is the dataset of a sweep"));
  CHECK(folder.contents() == before);
}

TEST_CASE("materials that nobody asks for are pointed out, with the names that are asked for") {
  const SceneFolder folder;
  write_text(folder / "m.json",
             R"({"format": "sarnerf-materials", "version": 1, "materials": {"steel": {"gamma0": 1}}})");
  write_text(folder / "named.obj", "usemtl walls\n" + read_text(folder / "box.obj"));
  const Outcome unused = folder.run({"named.obj", "--pitch", "45", "--materials", "m.json", "-q"});
  CHECK(has(unused.err, "m.json: none of its materials (steel) is used by the scene, which asks for: walls"));
  write_text(folder / "named.obj", "usemtl steel\n" + read_text(folder / "box.obj"));
  CHECK(folder.run({"named.obj", "--pitch", "45", "--materials", "m.json", "-q", "-o", "b"}).err.empty());
}

TEST_CASE("an image of nothing but shadow has one warning, with its reason") {
  const SceneFolder folder;
  // Behind the box, 3 m high, the ground is dark to 3 m beyond it.
  const Outcome outcome = folder.run({"box.obj", "--pitch", "45", "--size", "2x2", "--spacing", "0.2", "--aim",
                                      "0,0,-2.5", "--ground", "grass", "-q"});
  INFO(outcome.err);
  CHECK(n_lines(outcome.err) == 1);
  CHECK(has(outcome.err, "blank"));
  CHECK(has(outcome.err, "shadow"));
}

TEST_CASE("a ground that buries much of the scene is pointed out") {
  const SceneFolder folder;
  const auto at = [&](const char* height_m) {
    return folder.run(view({"--ground", "grass", "--ground-height", height_m, "--dry-run", "-q"})).err;
  };
  CHECK(at("0").empty());
  CHECK(has(at("2.4"), "80 %"));
}

TEST_CASE("scenes of few pixels: a hint on the spacing, and a warning below two") {
  const SceneFolder folder;
  const Outcome small = folder.run({"box.obj", "--pitch", "45"});
  CHECK(has(small.err, "--spacing"));
  CHECK_FALSE(has(small.err, "warning"));
  const Outcome quiet = folder.run({"box.obj", "--pitch", "45", "--dry-run", "-q"});
  CHECK(quiet.err.empty());
  const Outcome tiny = folder.run({"box.obj", "--pitch", "45", "--scale", "0.01", "--dry-run", "-q"});
  CHECK(n_lines(tiny.err) == 1);
  CHECK(has(tiny.err, "pixels"));
}

TEST_CASE("a range whose steps miss its end says where it stops") {
  const SceneFolder folder;
  CHECK(has(folder.run(view({"--azimuth", "0:100:30", "--dry-run"})).err,
            "--azimuth 0:100:30 stops at 90: its step does not reach 100"));
  CHECK_FALSE(has(folder.run(view({"--azimuth", "0:90:30", "--dry-run"})).err, "stops"));
}

TEST_CASE("unknown options are named, with the nearest known one") {
  const SceneFolder folder;
  CHECK(is_error_line(folder.run({"box.obj", "--pich", "45"}).err, "unknown option --pich (--pitch?)"));
  CHECK(is_error_line(folder.run({"box.obj", "45", "--altitde=3"}).err, "--altitde=3 (--altitude?)"));
  CHECK(is_error_line(folder.run({"box.obj", "--pitch", "45", "extra"}).err, "unexpected argument 'extra'"));
}

TEST_CASE("a sweep says what it continues and that it has finished") {
  const SceneFolder folder;
  const auto sweep = view({"--azimuth", "0:330:30", "-o", "s"});
  CHECK(has(folder.run(sweep).err, "finished: 12 views"));
  std::filesystem::remove(folder / "s/images/view_003.tif");
  const Outcome again = folder.run(sweep);
  CHECK(has(again.err, "continuing: 11 of 12 views are there"));
  CHECK(has(again.err, "finished: 12 views"));
}

TEST_CASE("warnings of a sweep come once, with the number of views") {
  const SceneFolder folder;
  const Outcome outcome =
      folder.run({"box.obj", "--pitch", "45", "--azimuth", "0:350:10", "--size", "4x4", "-q", "-o", "s"});
  INFO(outcome.err);
  CHECK(n_lines(outcome.err) <= 2);
  CHECK(has(outcome.err, "views, first at incidence 45, azimuth 0 deg"));
}

TEST_CASE("the plan counts in words and rounds what it estimates") {
  const SceneFolder folder;
  const Outcome plan = folder.run(view({"--dry-run", "--threads", "1"}));
  CHECK(has(plan.out, "12 triangles in 1 piece,"));
  CHECK(has(plan.out, "on 1 thread\n"));
  CHECK(has(plan.out, "less than 0.01 s"));
}

TEST_CASE("threads beyond all measure are cut down with a word") {
  const SceneFolder folder;
  const Outcome outcome = folder.run(view({"--threads", "100000", "-q"}));
  CHECK(outcome.code == 0);
  CHECK(n_lines(outcome.err) == 1);
  CHECK(has(outcome.err, "100000 threads"));
}

TEST_CASE("control characters of names do not reach the terminal") {
  const SceneFolder folder;
  std::filesystem::copy_file(folder / "box.obj", folder / "a\nb\x1b[2J.obj");
  for (const char* more : {"--explain", "-v"}) {
    const Outcome outcome = folder.run({"a\nb\x1b[2J.obj", "--pitch", "45", more, "-o", "out", "--overwrite"});
    CHECK(outcome.code == 0);
    CHECK_FALSE(has(outcome.err, "\x1b"));
    CHECK_FALSE(has(outcome.err, "\nb"));
  }
}

TEST_CASE("a working directory that is gone is an error like any other") {
  const SceneFolder folder;
  std::filesystem::create_directory(folder / "gone");
  const std::string box = folder / "box.obj";
  const Outcome outcome =
      sar_render({box, "--pitch", "45", "-q"}, {.folder = folder / "gone", .before = [&] { ::rmdir((folder / "gone").c_str()); }});
  INFO(outcome.err);
  CHECK(outcome.code == 1);
  CHECK(is_error_line(outcome.err, ""));
  CHECK_FALSE(has(outcome.err, "filesystem error"));
}

TEST_CASE("the pictures' scale is recorded, one for a sweep, and is what they show") {
  using Json = nlohmann::json;
  const SceneFolder folder;
  for (const char* quantity : {"power", "amplitude"}) {
    const std::string name = std::string("s_") + quantity;
    REQUIRE(folder.run(view({"--azimuth", "0:330:30", "--quantity", quantity, "-q", "-o", name})).code == 0);
    const Json display = Json::parse(read_text(folder / (name + "/dataset.json"))).at("provenance").at("display");
    CHECK(display.at("white_db").get<double>() - display.at("black_db").get<double>() == Approx(40.0));
  }
  const auto white = [&](const char* file) {
    return Json::parse(read_text(folder / file)).at("provenance").at("display").at("white_db").get<double>();
  };
  CHECK(white("s_power/dataset.json") == Approx(white("s_amplitude/dataset.json")).margin(0.011));
  // Grey is linear in decibels, from 0 at black to 255 at white, by one scale for all views.
  const double black_db = white("s_power/dataset.json") - 40.0;
  for (const char* name : {"view_000", "view_003"}) {
    const sarnerf::Image<float> power = sarnerf::read_image(folder / (std::string("s_power/images/") + name + ".tif"));
    const sarnerf::Image<float> grey = sarnerf::read_image(folder / (std::string("s_power/png/") + name + ".png"));
    double worst = 0.0;
    for (std::size_t p = 0; p < power.pixels().size(); ++p) {
      const double level = power.pixels()[p] > 0.0f ? 255.0 * (10.0 * std::log10(double{power.pixels()[p]}) - black_db) / 40.0 : 0.0;
      worst = worse(worst, std::abs(double{grey.pixels()[p]} - std::clamp(level, 0.0, 255.0)));
    }
    CHECK(worst <= 1.0);
    CHECK(*std::ranges::max_element(grey.pixels()) > 100.0f);
  }
  REQUIRE(folder.run(view({"-q", "-o", "one"})).code == 0);
  const Json one = Json::parse(read_text(folder / "one.json")).at("display");
  CHECK(one.at("black_db").get<double>() == Approx(one.at("white_db").get<double>() - 40.0));
}

TEST_CASE("options without an effect are pointed out, with what would give them one") {
  const SceneFolder folder;
  write_text(folder / "fog.json",
             R"({"format":"sarnerf-materials","version":1,"materials":{"default":{"extinction_per_m":0.1,"scattering_per_m":0.05}}})");
  const std::vector<std::vector<std::string>> without = {{"--integrator", "paper"}, {"--integrator", "exact"}, {"--seed", "7"},
                                                         {"--seed", "7", "--nesz", "-20"}, {"--ground-height", "-1"},
                                                         {"--extinction-per-density", "2"}};
  for (const auto& options : without) {
    const Outcome outcome = folder.run([&] {
      auto all = view({"--dry-run", "-q"});
      all.insert(all.end(), options.begin(), options.end());
      return all;
    }());
    INFO(options.front() << ": " << outcome.err);
    CHECK(outcome.code == 0);
    CHECK(n_lines(outcome.err) == 1);
    CHECK(has(outcome.err, "warning: " + options.front() + " has no effect: "));
  }
  const std::vector<std::vector<std::string>> with = {{"--integrator", "paper", "--materials", "fog.json"},
                                                      {"--integrator", "paper", "--engine", "voxel", "--voxel-size", "0.5"},
                                                      {"--seed", "7", "--looks", "1"},
                                                      {"--ground-height", "-1", "--ground", "grass"},
                                                      {"--ground-height", "-1", "--calibration", "sigma0"},
                                                      {"--ground-height", "-1", "--layers", "mask"}};
  for (const auto& options : with) {
    const Outcome outcome = folder.run([&] {
      auto all = view({"--dry-run", "-q"});
      all.insert(all.end(), options.begin(), options.end());
      return all;
    }());
    INFO(options.front() << " " << options.back() << ": " << outcome.err);
    CHECK(outcome.code == 0);
    CHECK_FALSE(has(outcome.err, "has no effect"));
  }
  // A configuration file is the user, too.
  write_text(folder / "c.toml", "seed = 7\n");
  CHECK(has(folder.run(view({"--dry-run", "-q", "--config", "c.toml"})).err, "--seed has no effect"));
}

TEST_CASE("empty texts, contradictions and names that stand alone are refused") {
  const SceneFolder folder;
  for (const char* option : {"--ground", "--materials", "--resolution", "--error", "--depression", "-o"}) {
    const Outcome outcome = folder.run(view({option, ""}));
    INFO(option << ": " << outcome.err);
    CHECK(outcome.code == 2);
    CHECK(is_error_line(outcome.err, "expected a value, found an empty text"));
  }
  CHECK(is_error_line(folder.run(view({"-q", "-v"})).err, "-q and -v contradict each other"));
  write_text(folder / "c.toml", "quiet = true\n");
  CHECK(folder.run(view({"-v", "--config", "c.toml", "--dry-run"})).code == 0);
  for (const char* layers : {"all,none", "wall,all", "none,mask"})
    CHECK(is_error_line(folder.run(view({"--layers", layers})).err, "stands alone"));
  CHECK(is_error_line(folder.run(view({"--looks", "0"})).err, "found 0\n"));
  CHECK(is_error_line(folder.run(view({"--looks", "0.5"})).err, "found 0.5\n"));
}

TEST_CASE("-q: stdout has the paths alone") {
  const SceneFolder folder;
  const Outcome one = folder.run(view({"-q", "-o", "a"}));
  CHECK(one.err.empty());
  CHECK(one.out == "a.tif\na.png\na.json\n");
  CHECK(folder.run(view({"-q", "-o", "a"})).out == one.out);  // already done
  CHECK(folder.run(view({"-q", "--azimuth", "0,90", "-o", "s"})).out == "s/dataset.json\n");
}

TEST_CASE("one view is no views") {
  const SceneFolder folder;
  const auto sweep = view({"--azimuth", "0,90", "-o", "s"});
  REQUIRE(folder.run(sweep).code == 0);
  std::filesystem::remove(folder / "s/images/view_000.tif");
  CHECK(has(folder.run(sweep).err, "continuing: 1 of 2 views is there"));
}

TEST_CASE("an automatic image of very many pixels asks for the unit") {
  const SceneFolder folder;
  const Outcome outcome = folder.run({"box.obj", "--pitch", "45", "--scale", "500", "--dry-run", "--threads", "1"});
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(has(outcome.err, "a large image: the scene measures 2 km: is it in other units (--units mm"));
}
