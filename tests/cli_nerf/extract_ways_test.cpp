// SPDX-License-Identifier: Apache-2.0
// sar_extract from networks, of models that are elsewhere, beside others, and what it prints.
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "../nerf/torch_catch.h"
#include "cube.h"
#include "programs.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/model_file.h"

using Json = nlohmann::json;

namespace {

const std::vector<std::string> kSmallNetwork{"--field",  "mlp",      "--option", "depth=3",  "--option", "width=64",
                                             "--option", "skip=1",   "--option", "direction_frequencies=2"};

std::size_t n_lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// A cube seen from 12 sides at 45°, as data/.
struct CubeFolder : ScratchFolder {
  CubeFolder() {
    write_cube(*this / "cube.obj");
    must(SAR_RENDER, with({"cube.obj", "--azimuth", "0:330:30", "-o", "data"}, pixels()));
  }

  static std::vector<std::string> pixels() { return {"--pitch", "45", "--size", "32x32", "--spacing", "0.3", "-q"}; }

  Outcome run(const char* program, const std::vector<std::string>& arguments) const {
    return run_program(program, arguments, {path()});
  }
  Outcome must(const char* program, const std::vector<std::string>& arguments) const {
    Outcome outcome = run(program, arguments);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome;
  }
  sarnerf::Image<float> image(const std::string& name) const { return sarnerf::read_image(*this / (name + ".tif")); }
};

struct LearnedPoints : LearnedScene {
  Outcome extract(const std::vector<std::string>& arguments) const { return run(SAR_EXTRACT, arguments); }
};

}  // namespace

TEST_CASE("a network goes all the way: learned, rendered, taken out as a volume, rendered from that, and scored") {
  const CubeFolder folder;
  folder.must(SAR_NERF_TRAIN, with({"data", "-o", "run", "--steps", "300", "-q"}, kSmallNetwork));
  folder.must(SAR_NERF_RENDER, {"run", "--azimuth", "15", "-o", "predicted"});
  folder.must(SAR_RENDER, with({"cube.obj", "--azimuth", "15", "--aim", "0,0,0", "-o", "truth"}, CubeFolder::pixels()));
  // A black image is as far from the truth as the truth is bright: 1.
  CHECK(sarnerf::relative_l2_error(folder.image("predicted"), folder.image("truth")) < 0.5);

  folder.must(SAR_EXTRACT, {"run", "body.vdb", "--resolution", "64", "--extent", "5", "--mesh", "body.ply",
                            "--ground-height", "0", "--truth", "cube.obj"});
  const Json report = json_of(folder / "body.report.json");
  CHECK(report["harmonics_residual"].get<double>() > 0.0);
  CHECK(report["harmonics_residual"].get<double>() < 0.5);
  // Fog is extracted where it is dense, and is hollow.
  CHECK(report["scores"]["extracted"]["iou"].get<double>() > 0.3);
  CHECK(report["scores"]["truth_volume"]["kind"] == "closed pieces");
  CHECK(std::filesystem::file_size(folder / "body.ply") > 1000);

  folder.must(SAR_RENDER, with({"body.vdb", "--azimuth", "15", "--aim", "0,0,0", "--elevations", "400", "-o", "volume"},
                               CubeFolder::pixels()));
  // Voxels and harmonics stand between them.
  CHECK(sarnerf::relative_l2_error(folder.image("volume"), folder.image("predicted")) < 0.25);
}

TEST_CASE("a surface goes all the way: learned, rendered, contoured, rendered from the volume, and scored as any mesh") {
  const CubeFolder folder;
  folder.must(SAR_NERF_TRAIN, {"data", "-o", "run", "--field", "surface", "--steps", "150", "-q"});
  folder.must(SAR_NERF_RENDER, {"run", "--azimuth", "15", "-o", "predicted"});
  folder.must(SAR_RENDER, with({"cube.obj", "--azimuth", "15", "--aim", "0,0,0", "-o", "truth"}, CubeFolder::pixels()));
  CHECK(sarnerf::relative_l2_error(folder.image("predicted"), folder.image("truth")) < 0.3);

  const Outcome extracted = folder.must(SAR_EXTRACT, {"run", "body.vdb", "--resolution", "64", "--extent", "5", "--mesh", "body.ply",
                                                      "--truth", "cube.obj"});
  CHECK(has(extracted.out, "1 component"));
  const Json report = json_of(folder / "body.report.json");
  CHECK(report["components"] == 1);
  CHECK(report["scores"]["extracted"]["observable_iou"].get<double>() > 0.75);
  CHECK(report["scores"]["extracted"]["symmetric_difference_m"].get<double>() < 0.15);
  std::ifstream ply(folder / "body.ply");
  std::string header(400, ' ');
  ply.read(header.data(), static_cast<std::streamsize>(header.size()));
  CHECK(has(header, "property uchar unseen"));

  folder.must(SAR_RENDER, with({"body.vdb", "--azimuth", "15", "--aim", "0,0,0", "--elevations", "400", "-o", "volume"},
                               CubeFolder::pixels()));
  CHECK(sarnerf::relative_l2_error(folder.image("volume"), folder.image("predicted")) < 0.3);

  // The same mesh, read back, with the views of the dataset or of the model.
  for (const char* source : {"data", "run"}) {
    const Outcome scored = folder.must(SAR_EXTRACT, {source, "--score", "body.ply", "--truth", "cube.obj", "--overwrite"});
    CHECK(has(scored.out, "body.ply.score.json"));
    const Json again = json_of(folder / "body.ply.score.json")["scores"]["extracted"];
    for (const char* key : {"iou", "observable_iou", "symmetric_difference_m"})
      CHECK(again[key].get<double>() == Approx(report["scores"]["extracted"][key].get<double>()).epsilon(1e-6));
  }
  CHECK(folder.run(SAR_EXTRACT, {"run", "--score", "body.ply", "--truth", "cube.obj"}).is_error("--overwrite"));
  const auto written = std::filesystem::last_write_time(folder / "body.ply.score.json");
  const Outcome planned = folder.must(SAR_EXTRACT, {"run", "--score", "body.ply", "--truth", "cube.obj", "--overwrite", "--dry-run"});
  CHECK(planned.out.starts_with("plan\n"));
  CHECK(std::filesystem::last_write_time(folder / "body.ply.score.json") == written);
  const Outcome without = folder.run(SAR_EXTRACT, {"run", "--score", "body.ply"});
  CHECK(without.code == 2);
  CHECK(has(without.err, "--truth"));
  CHECK(folder.run(SAR_EXTRACT, {"run", "other.vdb", "--threshold", "1"}).code == 2);
}

TEST_CASE("a model knows the rule that it was learned by, and its volume too") {
  const CubeFolder folder;
  for (const std::string rule : {"paper-gated", "exact"}) {
    folder.must(SAR_NERF_TRAIN, with({"data", "-o", rule, "--steps", "20", "-q", "--option", "integrator=" + rule}, kSmallNetwork));
    const std::filesystem::path model = folder / (rule + "/model.pt");
    CHECK(Json::parse(sarnerf::read_archive(model).json)["model"]["integrator"] == rule);
    CHECK(name(sarnerf::read_model(model).field->integrator()) == rule);
    const Outcome made = folder.must(SAR_EXTRACT, {rule, rule + ".vdb", "--resolution", "24", "--extent", "5", "-v"});
    CHECK(has(made.out, "integrator: " + rule + "\n"));
    CHECK(has(made.err, "--integrator paper-gated") == (rule == "paper-gated"));
  }
}

TEST_CASE("a model file by itself is enough") {
  const LearnedPoints scene;
  std::filesystem::create_directory(scene / "alone");
  std::filesystem::copy_file(scene / "run/model.pt", scene / "alone/model.pt");
  const Outcome made = run_program(SAR_EXTRACT, {"model.pt", "out.vdb"}, {scene / "alone"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK(made.out.starts_with("out.vdb\n"));
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(scene / "alone"))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  CHECK(names == std::vector<std::string>{"model.pt", "out.json", "out.report.json", "out.vdb"});
}

TEST_CASE("paths alone when quiet, a table and a line by default, grids when asked for") {
  const LearnedPoints scene;
  write_cube(scene / "cube.obj");
  const std::vector<std::string> request{"run",    "out.vdb", "--resolution", "40",     "--extent",
                                         "8",      "--mesh",  "out.ply",      "--truth", "cube.obj"};
  const Outcome made = scene.extract(request);
  REQUIRE(made.code == 0);
  // Two paths, a table with a head and two bodies, distances in layover and out of it, and one line.
  CHECK(n_lines(made.out) == 2 + 4 + 1 + 1);
  const std::string last = made.out.substr(made.out.rfind('\n', made.out.size() - 2) + 1);
  for (const char* piece : {"matter", "triangles", "memory"}) CHECK(has(last, piece));
  CHECK_FALSE(has(made.out, "brightness"));

  // The same again, which is there already.
  const Outcome quiet = scene.extract(with(request, {"-q"}));
  CHECK(quiet.out == "out.vdb\nout.ply\n");
  CHECK(quiet.err.empty());
  const Outcome verbose = scene.extract(with(request, {"-v"})), explained = scene.extract(with(request, {"--explain"}));
  for (const Outcome* outcome : {&verbose, &explained}) {
    CHECK(n_lines(outcome->out) > n_lines(made.out));
    CHECK(has(outcome->out, "brightness_3"));
    CHECK(outcome->out.ends_with(last));
  }
  const Outcome anew = scene.extract(with(request, {"-q", "--overwrite"}));
  CHECK(anew.out == quiet.out);
  std::istringstream told(anew.err);
  for (std::string line; std::getline(told, line);) CHECK(line.starts_with("sar_extract: warning: "));
}

TEST_CASE("a plan of an extraction writes nothing") {
  const LearnedPoints scene;
  const std::vector<std::string> request{"run", "new/out.vdb", "--resolution", "40", "--extent", "8", "--dry-run"};
  const Outcome planned = scene.extract(request);
  INFO(planned.err);
  CHECK(planned.code == 0);
  for (const char* piece : {"plan\n", "grid, ", "40^3 over 8 m, voxels of 0.2 m", "brightness (4 harmonics), occupancy", "Otsu",
                            "memory    about", "new/out.vdb"})
    CHECK(has(planned.out, piece));
  CHECK_FALSE(std::filesystem::exists(scene / "new"));
  CHECK(scene.extract(with(request, {"--centre", "1000,0,0"})).is_error("--extent"));
}

TEST_CASE("a truth without an inside is compared by its surface, and that is said") {
  const LearnedPoints scene;
  std::ofstream(scene / "sheet.obj") << "v -1 0.5 -1\nv 1 0.5 -1\nv 1 0.6 1\nv -1 0.6 1\nf 4 3 2 1\n";
  const std::vector<std::string> size{"--resolution", "40", "--extent", "8"};
  const Outcome sheet = scene.extract(with({"run", "sheet.vdb", "--truth", "sheet.obj"}, size));
  INFO(sheet.err);
  REQUIRE(sheet.code == 0);
  CHECK(has(sheet.out, "| extracted     |   - |          - |              - |         - |      - |      - |"));
  CHECK(has(sheet.out, "no volumes of the truth: "));
  const Json scores = json_of(scene / "sheet.report.json")["scores"];
  CHECK(scores["truth_volume"]["kind"] == "none");
  CHECK(scores["extracted"]["iou"].is_null());
  CHECK(scores["extracted"]["whole"]["chamfer_m"].get<double>() > 0.0);

  // Five sides of a cube: the wall is missing through which air comes in.
  std::ofstream(scene / "open.obj") << "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n"
                                       "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\n";
  // Six with a slit.
  std::ofstream(scene / "slit.obj") << "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n"
                                       "v -1 1.8 1\nv -1 1.8 -1\nf 1 2 3 4\nf 8 7 6 5\nf 1 10 5 6 2\nf 2 6 7 3\nf 3 7 8 9 4\nf 4 9 10 1\n";
  REQUIRE(scene.extract(with({"run", "open.vdb", "--truth", "open.obj", "--images", "none"}, size)).code == 0);
  CHECK(json_of(scene / "open.report.json")["scores"]["truth_volume"]["kind"] == "none");
  const Outcome slit = scene.extract(with({"run", "slit.vdb", "--truth", "slit.obj", "--images", "none"}, size));
  CHECK(has(slit.err, "winding number"));
  const Json scored = json_of(scene / "slit.report.json")["scores"];
  CHECK(scored["truth_volume"]["kind"] == "winding number");
  CHECK(scored["extracted"]["truth_volume_m3"].get<double>() == Approx(8.0).epsilon(0.02));
}

TEST_CASE("a truth somewhere else is told") {
  const LearnedPoints scene;
  std::ofstream(scene / "far.obj") << "v 999 0 -1\nv 1001 0 -1\nv 1000 0 1\nv 1000 2 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n";
  const Outcome told = scene.extract({"run", "far.vdb", "--resolution", "30", "--extent", "8", "--truth", "far.obj"});
  CHECK(told.code == 0);
  CHECK(has(told.err, "no place in common"));
}

TEST_CASE("numbers that cannot be meant are not answered by longer training") {
  const LearnedPoints scene;
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"--extent", "1e9"}, {"--ground-height", "1e6"}, {"--ground-height", "-1e6"}}) {
    const Outcome outcome = scene.extract(with({"run", "x.vdb"}, wrong));
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.is_error(wrong.front()));
    CHECK_FALSE(has(outcome.err, "longer"));
    CHECK_FALSE(std::filesystem::exists(scene / "x.vdb"));
  }
}

TEST_CASE("two extractions into one file: the second is told, and nothing is lost") {
  const LearnedPoints scene;
  Outcome second;
  bool met = false;
  const auto when_locked = [&](double /*age_s*/) {
    if (!met && std::filesystem::exists(scene / ".out.vdb.lock")) {
      met = true;
      second = scene.extract({"run", "out.vdb", "--resolution", "41"});
    }
    return 0;
  };
  const Outcome first = run_program(SAR_EXTRACT, {"run", "out.vdb", "--resolution", "200"}, {scene.path(), when_locked});
  REQUIRE(met);
  INFO(second.err);
  CHECK(first.code == 0);
  CHECK(second.code == 2);
  CHECK(second.is_error("out.vdb"));
  CHECK(json_of(scene / "out.json")["request"]["volume"]["resolution"] == 200);
  CHECK_FALSE(std::filesystem::exists(scene / ".out.vdb.lock"));
}
