// SPDX-License-Identifier: Apache-2.0
// sar_bench extraction: what it writes and refuses. What it measures is no matter of tests.
#include <nlohmann/json.hpp>

#include "../nerf/torch_catch.h"
#include "cube.h"
#include "programs.h"

using Json = nlohmann::json;

TEST_CASE("sar_bench extraction closes the loop and draws what came of it") {
  const ScratchFolder folder;
  write_cube(folder / "cube.obj");
  const auto study = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"extraction", "cube.obj"});
    return run_program(SAR_BENCH, arguments, {folder.path()});
  };
  // Long enough for a body on a busy machine, too: the time counts from the program's start.
  const Outcome made = study({"--views", "4x2", "--time", "8s", "--seeds", "2", "-o", "study"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  const Json runs = json_of(folder / "study/extraction.json").at("runs");
  REQUIRE(runs.size() == 2);
  for (int n = 0; n < 2; ++n) {
    const Json& run = runs[static_cast<std::size_t>(n)];
    CHECK(run.at("seed") == n + 1);
    CHECK(run.at("views") == 8);
    CHECK(run.at("iou").get<double>() > 0.0);
    CHECK(run.at("iou").get<double>() < 1.0);
    CHECK(run.at("method") == "surface");
    CHECK(run.at("symmetric_difference_m").get<double>() > 0.0);
    CHECK(run.at("carving_iou").get<double>() > 0.0);
    CHECK(run.at("visible_chamfer_m").get<double>() > 0.0);
    CHECK(run.at("training_s").get<double>() > 0.0);
    CHECK(run.at("extraction_s").get<double>() > 0.0);
  }
  const Json data = json_of(folder / "study/cube.4x2/dataset.json").at("views");
  REQUIRE(data.size() == 8);
  CHECK(data.front().at("incidence_deg") == 35.0);
  CHECK(data.back().at("incidence_deg") == 55.0);
  CHECK(made.out == read_text(folder / "study/extraction.md"));
  for (const char* axis : {"difference-seconds", "difference-views", "chamfer-seconds", "chamfer-views"}) {
    const std::string name = "study/extraction-cube-" + std::string(axis);
    CHECK(has(read_text(folder / (name + ".svg")), "<svg"));
    CHECK(read_text(folder / (name + ".png")).substr(1, 3) == "PNG");
  }
  CHECK(has(read_text(folder / "study/extraction-cube-difference-views.svg"), "carving alone"));

  const Outcome beside = study({"--views", "4x2", "--time", "4s", "--field", "grid", "--beside", "study/extraction.json", "-o", "both"});
  INFO(beside.err);
  REQUIRE(beside.code == 0);
  CHECK(json_of(folder / "both/extraction.json").at("runs").size() == 3);
  CHECK(has(read_text(folder / "both/extraction-cube-difference-seconds.svg"), "surface, 8 views"));

  const auto refused = [&](int code, const std::string& piece, const std::vector<std::string>& arguments) {
    const Outcome outcome = study(arguments);
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.is_error(piece));
  };
  refused(2, "--overwrite", {"-o", "study"});
  refused(2, "--views", {"--views", "1x2", "-o", "other"});
  refused(2, "--time", {"--time", "soon", "-o", "other"});
  refused(2, "--field", {"--field", "net", "-o", "other"});
}
