// SPDX-License-Identifier: Apache-2.0
// --error, and what is said of errors without it.
#include <nlohmann/json.hpp>

#include "catch.h"
#include "program.h"

namespace {

const std::vector<std::string> kBoxView = {"box.obj", "--pitch", "50", "--azimuth", "25", "--size", "48x48",
                                        "--spacing", "0.15"};

nlohmann::json json(const std::filesystem::path& file) { return nlohmann::json::parse(read_text(file)); }

}  // namespace

TEST_CASE("--error chooses the sampling, says so, and the report says what came out") {
  const SceneFolder folder;
  int rays_before = 0;
  for (const std::string text : {"5%", "0.01", "0.3%"}) {
    const Outcome outcome = folder.run(with(kBoxView, {"--error", text, "--explain", "-o", "a" + text}));
    INFO(text << "\n" << outcome.err);
    REQUIRE(outcome.code == 0);
    CHECK(has(outcome.err, "slices a row for an error of "));
    CHECK(has(outcome.err, "error about "));
    const double asked = text == "5%" ? 0.05 : text == "0.01" ? 0.01 : 0.003;
    const auto report = json(folder / ("a" + text + ".report.json"));
    CHECK(report["error_estimate"]["asked"] == Approx(asked));
    CHECK(report["error_estimate"]["most"] <= asked);
    const auto recipe = json(folder / ("a" + text + ".json"));
    CHECK(recipe["request"]["computation"]["error"] == Approx(asked));
    const int rays = recipe["resolved"]["elevations"][0].get<int>() * recipe["resolved"]["sub_rows"][0].get<int>();
    CHECK(rays > rays_before);
    rays_before = rays;
  }
  // The same again is done; another tolerance is another recipe.
  const Outcome again = folder.run(with(kBoxView, {"--error", "1%", "-o", "a0.01"}));
  CHECK(again.code == 0);
  CHECK(has(again.err, "already done"));
  CHECK(folder.run(with(kBoxView, {"--error", "2%", "-o", "a0.01"})).code == 2);
}

TEST_CASE("every render says its error; -q does not; a sweep says the least and the most") {
  const SceneFolder folder;
  const Outcome one = folder.run(with(kBoxView, {"-o", "one"}));
  CHECK(has(one.err, "error about "));
  CHECK(json(folder / "one.report.json")["error_estimate"]["most"] > 0.0);
  CHECK(folder.run(with(kBoxView, {"-o", "quiet", "-q"})).err.empty());
  std::vector<std::string> sweep = with(kBoxView, {"-o", "sweep", "--error", "1%"});
  sweep[4] = "0:90:30";
  const Outcome many = folder.run(sweep);
  REQUIRE(many.code == 0);
  CHECK(has(many.err, "finished: 4 views; error about "));
  CHECK(json(folder / "sweep/dataset.report.json")["error_estimate"]["most"] <= 0.01);
}

TEST_CASE("--error is refused where it means nothing") {
  const SceneFolder folder;
  const auto before = folder.contents();
  for (const auto& [value, piece] : {std::pair{"5", "expected 0.1% to 20%"}, std::pair{"0", "expected 0.1% to 20%"},
                                     std::pair{"0.01%", "expected 0.1% to 20%"}, std::pair{"low", "--error"}}) {
    const Outcome outcome = folder.run(with(kBoxView, {"--error", value}));
    INFO(value << ": " << outcome.err);
    CHECK(outcome.code == 2);
    CHECK(is_error_line(outcome.err, piece));
  }
  CHECK(is_error_line(folder.run(with(kBoxView, {"--error", "1%", "--sub-rows", "4"})).err, "--sub-rows"));
  CHECK(is_error_line(folder.run(with(kBoxView, {"--error", "1%", "--engine", "voxel"})).err, "--engine voxel"));
  CHECK(folder.contents() == before);
}

TEST_CASE("an error that cannot be estimated is said to be so, and null in the report") {
  const SceneFolder folder;
  for (const char* engine : {"surface", "voxel"}) {
    for (const char* rays : {"1", "2", "5"}) {
      const std::string name = std::string(engine) + rays;
      const Outcome outcome = folder.run(with(kBoxView, {"--elevations", rays, "--engine", engine, "-o", name, "--layers", "error"}));
      INFO(name << ": " << outcome.err);
      REQUIRE(outcome.code == 0);
      CHECK(has(outcome.err, "warning: the error cannot be estimated: "));
      CHECK(has(outcome.err, "6 are needed (--elevations)"));
      CHECK(has(outcome.err, "the error cannot be estimated\n"));
      CHECK_FALSE(has(outcome.err, "error about"));
      CHECK(json(folder / (name + ".report.json"))["error_estimate"].is_null());
    }
  }
  const Outcome slices = folder.run({"box.obj", "--pitch", "50", "--size", "4x48", "--spacing", "0.15", "--sub-rows", "1", "-o", "rows"});
  CHECK(has(slices.err, "6 are needed (--sub-rows)"));
  const Outcome plan = folder.run(with(kBoxView, {"--elevations", "1", "--dry-run"}));
  CHECK(has(plan.out, "the error estimate: 1 elevation ray across the scene gives"));
  CHECK_FALSE(has(folder.run(with(kBoxView, {"--elevations", "6", "-o", "six"})).err, "cannot be estimated"));
}
