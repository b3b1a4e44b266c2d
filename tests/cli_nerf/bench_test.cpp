// SPDX-License-Identifier: Apache-2.0
// sar_nerf_bench on a dataset of 16 x 16 pixels: what it writes and refuses. What it measures is no matter of tests.
#include <nlohmann/json.hpp>

#include "../nerf/torch_catch.h"
#include "programs.h"

using Json = nlohmann::json;

namespace {

/// Training and test views as small as learning makes sense of.
struct TinyScene : SmallScene {
  TinyScene() : SmallScene(1) {
    write_dataset("tiny", 6, 0.0, 16);
    write_dataset("test", 12, 0.0, 16);
  }
};

}  // namespace

TEST_CASE("sar_nerf_bench writes curve and tables of every contestant") {
  const TinyScene scene;
  const Outcome study = scene.bench({"tiny/", "--against", "test/", "--time", "2s", "--time", "grid=1s,2s", "--seeds",
                                     "2", "--views", "3", "-o", "study/"});
  INFO(study.err);
  REQUIRE(study.code == 0);
  const Json result = json_of(scene / "study/learning.json");
  CHECK(result.at("environment").at("loading_s").get<double>() > 0.0);
  CHECK(result.at("training_views") == 6);
  CHECK(result.at("baselines").size() >= 3);
  const std::vector<std::string> views = result.at("views");
  REQUIRE(views.size() == 3);
  for (const std::string& view : views) {
    // Every second test view has the angles of a training view.
    const int number = std::stoi(view.substr(view.find('/') + 1));
    CHECK(number % 2 == 1);
  }

  std::vector<std::string> runs;
  for (const Json& run : result.at("runs")) {
    runs.push_back(run.at("field").get<std::string>() + " " + run.at("planned_s").dump() + " " + run.at("seed").dump());
    INFO(runs.back());
    const Json& points = run.at("points");
    REQUIRE(points.size() >= 1);
    const double loading_s = result.at("environment").at("loading_s").get<double>();
    double last_s = run.at("start_s").get<double>();
    CHECK(last_s > loading_s);
    int last_step = 0;
    for (const Json& point : points) {
      CHECK(point.at("seconds").get<double>() > last_s);
      last_s = point.at("seconds").get<double>();
      CHECK(point.at("step").get<int>() > last_step);
      last_step = point.at("step").get<int>();
      CHECK(std::isfinite(point.at("psnr_power_db").get<double>()));
    }
  }
  CHECK(runs == std::vector<std::string>{"grid 1.0 1", "grid 1.0 2", "grid 2.0 1", "grid 2.0 2", "mlp 2.0 1",
                                         "mlp 2.0 2", "paper 2.0 1", "paper 2.0 2"});

  CHECK(study.out == read_text(scene / "study/learning.md"));
  for (const char* piece : {"| seconds to ", "| grid ", "| mlp ", "| paper ", "paper's best", "Best baseline: "})
    CHECK(has(study.out, piece));
  const std::string picture = read_text(scene / "study/learning.svg");
  for (const char* piece : {"<svg", "grid, each run", "mlp, one run", "paper, one run", "interpolation"})
    CHECK(has(picture, piece));
  CHECK(read_text(scene / "study/learning.png").substr(1, 3) == "PNG");

  const Outcome again = scene.bench({"tiny", "--against", "test", "-o", "study"});
  CHECK(again.code == 2);
  CHECK(again.is_error("--overwrite"));
}

TEST_CASE("sar_nerf_bench refuses in one line what it cannot measure") {
  const TinyScene scene;
  const auto refused = [&](const std::vector<std::string>& arguments, int code, const std::string& piece) {
    const Outcome outcome = scene.bench(arguments);
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.is_error(piece));
    CHECK(outcome.out.empty());
    CHECK_FALSE(std::filesystem::exists(scene / "tiny_learning"));
  };
  refused({"tiny", "--against", "test", "--tim", "2s"}, 2, "--tim");
  refused({"tiny"}, 2, "--against");
  refused({"tiny", "--against", "test", "--fields", "grids"}, 2, "'grids' (grid?)");
  refused({"tiny", "--against", "test", "--time", "soon"}, 2, "--time");
  refused({"tiny", "--against", "test", "--fields", "grid", "--time", "mlp=2s"}, 2, "mlp takes no part");
  refused({"tiny", "--against", "test", "--seeds", "0"}, 2, "--seeds");
  refused({"tiny", "--against", "tiny"}, 2, "not trained on");
  refused({"tiny", "--against", "test", "-o", "test"}, 2, "lies inside the input");
  refused({"absent", "--against", "test"}, 3, "absent");
}

#ifdef SAR_BENCH
TEST_CASE("sar_bench learning is sar_nerf_bench") {
  const TinyScene scene;
  const Outcome help = scene.run(SAR_BENCH, {"learning", "--help"});
  CHECK(help.code == 0);
  CHECK(has(help.out, "--against"));
  const Outcome wrong = scene.run(SAR_BENCH, {"learning", "tiny", "--against", "test", "--nope"});
  CHECK(wrong.code == 2);
  CHECK(wrong.is_error("--nope"));
}
#endif
