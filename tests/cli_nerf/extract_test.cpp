// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "../nerf/torch_catch.h"
#include "cube.h"
#include "programs.h"

using Json = nlohmann::json;

namespace {

/// A cube as a truth, 12 views of it, and a model of them in run/.
struct CubeLearnedOnce : SmallScene {
  CubeLearnedOnce() {
    write_cube(*this / "cube.obj");
    REQUIRE(run(SAR_RENDER, {"cube.obj", "--pitch", "45", "--azimuth", "0:330:30", "--size", "32x32", "--spacing", "0.3", "-o",
                             "views", "-q"})
                .code == 0);
    REQUIRE(train({"views", "-o", "run", "--steps", "100", "-q"}).code == 0);
  }
};

struct LearnedCube : SmallScene {
  LearnedCube() : SmallScene(filled_once<CubeLearnedOnce>().path()) {}

  Outcome extract(const std::vector<std::string>& arguments) const { return run(SAR_EXTRACT, arguments); }
};

}  // namespace

TEST_CASE("a model becomes a volume and a mesh and a picture and a score") {
  const LearnedCube scene;
  const std::vector<std::string> arguments{"run",       "out.vdb",       "--resolution", "40",      "--extent", "8",
                                           "--mesh",    "out.ply",       "--preview",    "out.png", "--truth",  "cube.obj",
                                           "--ground-height", "0"};
  const Outcome made = scene.extract(arguments);
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK(made.out.starts_with("out.vdb\nout.ply\nout.png\n"));
  for (const char* piece : {"extracted", "carving alone", "triangles"})
    CHECK(has(made.out, piece));
  const Json report = json_of(scene / "out.report.json");
  // Learned for a second from one pitch. Fog has no inside; carving takes nothing away from the cube.
  const Json &extracted = report["scores"]["extracted"], &carving = report["scores"]["carving"];
  CHECK(extracted["iou"].get<double>() > 0.5);
  CHECK(extracted["visible"]["chamfer_m"].get<double>() < 0.2);  // a voxel
  CHECK(carving["recall"].get<double>() > 0.99);
  CHECK(report["seconds"]["total"].get<double>() > 0.0);

  const Outcome again = scene.extract(arguments);
  CHECK(again.code == 0);
  CHECK(has(again.err, "already done"));
  CHECK(again.out == made.out);
  auto others = arguments;
  others[3] = "41";
  CHECK(scene.extract(others).is_error("--overwrite"));
  others.push_back("--overwrite");
  CHECK(scene.extract(others).code == 0);

  SECTION("the same bytes from the same model") {
    REQUIRE(scene.extract({"run", "one.vdb", "--resolution", "30", "--threads", "1", "-q"}).code == 0);
    REQUIRE(scene.extract({"run", "two.vdb", "--resolution", "30", "--threads", "2", "-q"}).code == 0);
    const auto bytes = [&](const char* name) {
      std::ifstream file(scene / name, std::ios::binary);
      return std::string(std::istreambuf_iterator<char>(file), {});
    };
    CHECK(bytes("one.vdb") == bytes("two.vdb"));
  }
  SECTION("the volume is called by the run, however that is named") {
    std::filesystem::copy_file(scene / "run/model.pt", scene / "other.pt");
    for (const auto& [model, name] : {std::pair("run", "run.vdb"), std::pair("run/", "run.vdb"),
                                      std::pair("run/model.pt", "run.vdb"), std::pair("other.pt", "other.vdb")}) {
      const Outcome named = scene.extract({model, "--resolution", "20", "--overwrite", "-q"});
      INFO(model << ": " << named.err);
      CHECK(named.out.starts_with(std::string(name) + "\n"));
    }
  }
  SECTION("a truth in other units is told") {
    const Outcome told =
        scene.extract({"run", "u.vdb", "--resolution", "30", "--truth", "cube.obj", "--truth-units", "mm"});
    CHECK(told.code == 0);
    CHECK(has(told.err, "times as large"));
  }
}

TEST_CASE("what cannot be extracted gives one line and the right exit code") {
  const LearnedCube scene;
  const auto fails = [&](int code, const std::string& piece, std::vector<std::string> more) {
    more.insert(more.begin(), {"run", "x.vdb"});
    const Outcome outcome = scene.extract(more);
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.is_error(piece));
    CHECK_FALSE(std::filesystem::exists(scene / "x.vdb"));
  };
  fails(2, "--threshold", {"--threshold", "1e9"});
  fails(2, "--extent", {"--centre", "1000,0,0"});
  fails(2, "--max-memory", {"--max-memory", "10M"});
  fails(2, "--field surface", {"--solid"});
  fails(2, "--shell", {"--shell"});
  fails(2, "--resolution native", {"--resolution", "native", "--extent", "3"});
  fails(2, ".ply", {"--mesh", "x.gltf"});
  fails(2, ".png", {"--preview", "x.jpg"});
  fails(3, "nowhere.obj", {"--truth", "nowhere.obj"});
  CHECK(scene.extract({"nowhere", "x.vdb"}).code == 3);
  CHECK(scene.extract({"run", "x.obj"}).is_error(".vdb"));
  std::filesystem::resize_file(scene / "run/model.pt", 1000);
  CHECK(scene.extract({"run", "x.vdb"}).code == 3);
}
