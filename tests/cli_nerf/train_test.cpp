// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "../nerf/torch_catch.h"
#include "programs.h"
#include "sarnerf/nerf/model_file.h"

using Json = nlohmann::json;

TEST_CASE("a run folder holds a model, its history and its reports") {
  const SmallScene scene;
  scene.write_dataset("test", 24, 0.0);
  const Outcome trained =
      scene.train({"data/", "--steps", "60", "-o", "run/", "--against", "test", "--explain"});
  INFO(trained.err);
  REQUIRE(trained.code == 0);
  CHECK(trained.out == "run\n");
  CHECK(has(trained.err, "12 views with the angles of a training view left out"));
  CHECK(has(trained.err, "no weights given"));

  const sarnerf::Model model = sarnerf::read_model(scene / "run/model.pt");
  CHECK(model.field->kind() == "grid");
  CHECK(model.info.steps == 60);
  CHECK(model.info.training_views.size() == 12);
  CHECK(model.info.acquisition.n_range == 32);
  CHECK(model.info.reference_bin_m == 0.3);
  CHECK(model.info.dataset_sha256.size() == 64);

  const Json report = json_of(scene / "run/report.json");
  CHECK(report.at("steps") == 60);
  CHECK(report.at("evaluation").at("views").size() == 12);
  CHECK(report.at("evaluation").at("model").at("views").size() == 12);
  CHECK(report.at("evaluation").at("baselines").size() >= 3);
  CHECK(report.at("seconds").at("start-up").get<double>() > 0.0);

  std::istringstream lines(read_text(scene / "run/metrics.jsonl"));
  double last_s = 0.0;
  int n_psnr = 0;
  Json line;
  for (std::string text; std::getline(lines, text);) {
    line = Json::parse(text);
    CHECK(line.at("seconds").get<double>() > last_s);
    last_s = line.at("seconds").get<double>();
    n_psnr += line.contains("psnr_power_db") ? 1 : 0;
  }
  CHECK(line.at("step") == 60);
  CHECK(n_psnr >= 1);
  const auto n_pictures = std::distance(std::filesystem::directory_iterator(scene / "run/val"), {});
  CHECK(n_pictures == 8);
  const std::string page = read_text(scene / "run/report.html");
  CHECK(has(page, "<html"));
  CHECK(has(page, "LPIPS"));

  const Outcome other =
      scene.train({"data", "--steps", "60", "-o", "run", "--seed", "2", "--against", "test"});
  CHECK(other.code == 2);
  CHECK(other.is_error("seed: 1 there, 2 now"));
  CHECK(scene.train({"data", "--steps", "20", "-o", "run", "-q", "--overwrite"}).code == 0);
  CHECK(sarnerf::read_model(scene / "run/model.pt").info.steps == 20);
  CHECK(std::filesystem::is_empty(scene / "run/val"));
}

TEST_CASE("a run's configuration holds what the scene and its comparison were told to be") {
  const SmallScene scene;
  scene.write_dataset("test", 24, 0.0);
  const Outcome told = scene.train({"data", "-o", "run", "--steps", "2", "--against", "test", "--despeckle", "60",
                                    "--register", "on", "--ground-height", "-1.25", "--scene-height", "2.5"});
  INFO(told.err);
  REQUIRE(told.code == 0);
  const std::string config = read_text(scene / "run/config.toml");
  for (const char* line : {"despeckle = \"60.0\"", "register = \"on\"", "ground-height = \"-1.25\"", "scene-height = \"2.5\""})
    CHECK(has(config, line));
  CHECK(sarnerf::read_model(scene / "run/model.pt").info.scene_box_m.min.y == -1.25);
  REQUIRE(scene.train({"--config", "run/config.toml", "-o", "again"}).code == 0);
  CHECK(read_text(scene / "again/config.toml") == config);
  const auto scores = [&](const char* run) { return json_of(scene / run / "report.json").at("despeckled"); };
  CHECK(scores("run").at("model") == scores("again").at("model"));

  const Outcome high = scene.train({"data", "-o", "high", "--ground-height", "500"});
  CHECK(high.code == 2);
  CHECK(high.is_error("nothing can stand on it"));
  CHECK_FALSE(std::filesystem::exists(scene / "high"));
}

TEST_CASE("an impulse response is told to training and taken from views again") {
  const SmallScene scene;
  const Outcome told = scene.train({"data", "-o", "run", "--steps", "30", "--resolution", "2,1.5", "--window", "taylor:-35", "--explain"});
  INFO(told.err);
  REQUIRE(told.code == 0);
  CHECK(has(told.err, "impulse response  2 x 1.5 m (azimuth x range), window taylor:-35,4"));
  const std::string config = read_text(scene / "run/config.toml");
  for (const char* line : {"resolution = \"2.0,1.5\"", "window = \"taylor:-35,4\""}) CHECK(has(config, line));
  REQUIRE(scene.train({"--config", "run/config.toml", "-o", "again"}).code == 0);
  CHECK(read_text(scene / "again/config.toml") == config);

  REQUIRE(scene.render({"run", "--azimuth", "0:300:60", "-o", "seen"}).code == 0);
  REQUIRE(scene.render({"run", "--azimuth", "0:300:60", "--resolution", "none", "-o", "sharp"}).code == 0);
  CHECK(read_text(scene / "seen/images/view_000.tif") != read_text(scene / "sharp/images/view_000.tif"));
  CHECK(sarnerf::read_manifest(scene / "seen").resolution == sarnerf::read_model(scene / "run/model.pt").field->resolution);
  CHECK_FALSE(sarnerf::read_manifest(scene / "sharp").resolution);
  CHECK(scene.render({"run", "--azimuth", "0:300:60", "-o", "sharp"}).is_error("resolution_m"));

  // A dataset that says it needs no option, and may be contradicted.
  REQUIRE(scene.train({"seen", "-o", "auto", "--steps", "2"}).code == 0);
  CHECK(sarnerf::read_model(scene / "auto/model.pt").field->resolution);
  REQUIRE(scene.train({"seen", "-o", "none", "--steps", "2", "--resolution", "none"}).code == 0);
  CHECK_FALSE(sarnerf::read_model(scene / "none/model.pt").field->resolution);
  CHECK(scene.render({"none", "--resolution", "2"}).is_error("sar_nerf_train --resolution"));
  const Outcome coarse = scene.render({"run", "--spacing", "9", "-o", "coarse"});
  CHECK(coarse.code == 2);
  CHECK(coarse.is_error("under-samples"));
  std::string manifest = read_text(scene / "seen/dataset.json");
  manifest.replace(manifest.find("1.5"), 3, "0.1");
  write_text(scene / "seen/dataset.json", manifest);
  const Outcome impossible = scene.train({"seen", "-o", "impossible", "--steps", "2"});
  CHECK(impossible.code == 0);
  CHECK(has(impossible.err, "is ignored"));
}

TEST_CASE("training learns: held-out views come closer than they began") {
  const SmallScene scene(24);
  REQUIRE(scene.train({"data", "--steps", "300", "-o", "run", "--holdout", "4", "-q"}).code == 0);
  std::istringstream lines(read_text(scene / "run/metrics.jsonl"));
  std::vector<double> losses;
  for (std::string text; std::getline(lines, text);)
    losses.push_back(Json::parse(text).at("loss").get<double>());
  REQUIRE(losses.size() >= 20);
  CHECK(losses.back() < 0.5 * losses.front());
  const Json report = json_of(scene / "run/report.json");
  CHECK(report.at("dataset").at("training_views") == 20);
  CHECK(report.at("evaluation").at("views").size() == 4);
  // A blank prediction of these sparse images would have less.
  const double psnr_db =
      report.at("evaluation").at("model").at("mean").at("psnr_power_db").get<double>();
  CHECK(psnr_db > 20.0);
}

TEST_CASE("the time that --time gives is kept, the program's start included") {
  const SmallScene scene;
  const Outcome trained = scene.train({"data", "--time", "5s", "-o", "run", "-q"});
  REQUIRE(trained.code == 0);
  // The last step ends within the time; what comes after it is not counted. No step of this scene takes a second, but a busy machine may
  // stall: as long as its longest pause between two lines.
  std::istringstream lines(read_text(scene / "run/metrics.jsonl"));
  double last_s = 0.0, longest_s = 0.0;
  for (std::string line; std::getline(lines, line);) {
    const double s = Json::parse(line).at("seconds").get<double>();
    if (last_s > 0.0) longest_s = std::max(longest_s, s - last_s);
    last_s = s;
  }
  CHECK(last_s > 4.0 - longest_s);
  CHECK(last_s <= 5.0 + longest_s);
}

TEST_CASE("options of training are checked before anything is written") {
  const SmallScene scene(4);
  const auto refused = [&](const std::vector<std::string>& options, const std::string& piece) {
    std::vector<std::string> all{"data", "-o", "run"};
    all.insert(all.end(), options.begin(), options.end());
    const Outcome outcome = scene.train(all);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(outcome.is_error(piece));
    CHECK_FALSE(std::filesystem::exists(scene / "run"));
  };
  refused({"--steps", "10", "--time", "5s"}, "--steps and --time");
  refused({"--steps", "0"}, "--steps");
  refused({"--field", "mlp", "--option", "direction_frequencies=-2"}, "expected -1 to 64");
  refused({"--time", "soon"}, "a time such as 90s");
  refused({"--holdout", "4"}, "none left to learn from");
  refused({"--field", "gird"}, "--field");
  refused({"--option", "rows_per_stop=3"}, "rows_per_step?");
  refused({"--option", "rows_per_step=many"}, "a whole number");
  refused({"--option", "rows_per_step"}, "NAME=VALUE");
  refused({"--option", "seed=3"}, "--seed");
  refused({"--option", "rows_per_step=0"}, "expected 1 to");
  refused({"--option", "density_rate=-1"}, "at least 0");
  refused({"--option", "voxel_size_m=1e-5"}, "use larger ones");
  refused({"--max-memory", "1M"}, "--max-memory");
  refused({"--stops", "3"}, "--steps?");
  refused({"--smoothness", "validated"}, "--smoothness is of an older version: its rule was dropped, leave it out");
  refused({"--window", "hann"}, "give its --resolution too");
  refused({"--resolution", "-1"}, "--resolution");
  refused({"--resolution", "0.9", "--window", "tailor"}, "taylor");
  refused({"--resolution", "0.01"}, "under-samples");
  CHECK(scene.train({"data", "-o", "still", "--field", "mlp", "--steps", "1", "--option", "width=32", "--option", "depth=2", "--option", "skip=-1",
                     "--option", "direction_frequencies=-1", "-q"}).code == 0);
  CHECK(scene.train({"--resume", "nowhere"}).code == 3);
  CHECK(scene.train({"data", "-o", "data"}).is_error("lies inside the input"));
  CHECK(scene.train({"--help"}).code == 0);
  CHECK(scene.train({"--version"}).out.starts_with("sar_nerf_train "));
}

TEST_CASE("a dry run prints the plan and writes nothing; a dataset may be named by its manifest") {
  const SmallScene scene;
  const Outcome plan = scene.train({"data/dataset.json", "-o", "run", "--dry-run"});
  INFO(plan.err);
  CHECK(plan.code == 0);
  CHECK(has(plan.out, "12 views of data, 32 x 32 pixels"));
  CHECK_FALSE(std::filesystem::exists(scene / "run"));
  const Outcome trained = scene.train({"data/dataset.json", "--steps", "5", "-q"});
  INFO(trained.err);
  CHECK(trained.code == 0);
  CHECK(trained.out == "data_run\n");
  CHECK(trained.err.empty());
  CHECK(has(scene.train({"data", "--steps", "5"}).err, "already done"));
  CHECK(scene.train({"data", "-o", "data/run"}).is_error("lies inside the input"));
}

TEST_CASE("what training cannot change is not advised") {
  const SmallScene scene(1);
  CHECK(scene.train({"data", "-o", "run", "--resolution", "0.1"}).is_error("which training cannot change"));
  CHECK_FALSE(has(scene.train({"data", "-o", "run", "--resolution", "0.1"}).err, "--spacing"));
  for (const char* coarse : {"5", "100", "0.9,100"})
    CHECK(scene.train({"data", "-o", "run", "--resolution", coarse}).is_error("too coarse for images"));
  const Outcome memory = scene.train({"data", "-o", "run", "--max-memory", "1M"});
  CHECK(memory.is_error("the images of 1 view "));
  CHECK_FALSE(has(memory.err, "fewer"));
}

TEST_CASE("an unfinished dataset is learned from with a warning") {
  const SmallScene scene;
  CHECK_FALSE(has(scene.train({"data", "-o", "whole", "--steps", "3"}).err, "interrupted"));
  scene.edit("data/dataset.json", "\"format\"", "\"planned_views\": 576, \"format\"");
  const Outcome outcome = scene.train({"data", "-o", "run", "--steps", "3", "--against", "data"});
  CHECK(outcome.code == 0);
  CHECK(has(outcome.err, "warning: data: 12 of 576 views"));
  CHECK(has(outcome.err, "warning: --against data: 12 of 576 views"));
}

TEST_CASE("a training that diverges ends with exit code 4 and keeps the last good state") {
  const SmallScene scene(6);
  const Outcome diverged = scene.train({"data", "-o", "run", "--steps", "2000", "-q", "--option",
                                        "density_rate=1e30", "--option", "source_rate=1e30"});
  INFO(diverged.err);
  REQUIRE(diverged.code == 4);
  CHECK(diverged.is_error("last good state is kept"));
  CHECK_NOTHROW(sarnerf::read_model(scene / "run/model.pt"));
  CHECK_NOTHROW(sarnerf::read_archive(scene / "run/checkpoints/latest.pt"));
}

TEST_CASE("a trial chooses the field, and a run keeps it") {
  const SmallScene scene;
  scene.write_dataset("few", 8, 0.0, 14);
  const Outcome made = scene.train({"few", "-o", "run", "--field", "auto", "--steps", "20", "--explain"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK(has(made.err, "held out from a trial of 400 steps"));
  const auto json = [&](const char* name) { return json_of(scene / name); };
  const Json trial = json("run/trial.json"), report = json("run/report.json");
  const std::string field = trial["field"];
  REQUIRE(trial["trials"].size() == 2);
  for (const Json& one : trial["trials"]) CHECK((one["psnr_power_db"] <= trial["trials"][field == "surface" ? 0 : 1]["psnr_power_db"]));
  CHECK(report["field"]["kind"] == field);
  CHECK(report["field"]["chosen"].get<std::string>().starts_with(field + ": "));
  CHECK(report["seconds"].contains("trial of fields"));

  const Outcome again = scene.train({"few", "-o", "run", "--field", "auto", "--steps", "20"});
  CHECK(has(again.err, "already done"));
  CHECK_FALSE(has(again.err, "trial"));
  CHECK(has(scene.train({"few", "-o", "run", "--field", field, "--steps", "20"}).err, "already done"));
  REQUIRE(scene.train({"--resume", "run", "--steps", "30", "-q"}).code == 0);
  CHECK(json("run/report.json")["field"]["chosen"] == report["field"]["chosen"]);

  const Outcome option = scene.train({"few", "-o", "other", "--field", "auto", "--option", "albedo_rate=0.1"});
  CHECK(option.code == 2);
  CHECK(option.is_error("--field surface"));
}

TEST_CASE("with patience, training ends when held-out views come no closer") {
  const SmallScene scene(24);
  const auto steps_of = [&](const std::string& run) {
    return json_of(scene / run / "report.json").at("steps").get<int>();
  };
  const std::vector<std::string> options{"data", "--steps", "200", "--holdout", "3", "-q"};
  // Rates too small to come closer to anything.
  const std::vector<std::string> still{"--option", "density_rate=0", "--option", "source_rate=0",
                                       "--option", "n_prunings=0", "--option", "n_levels=1"};
  const Outcome ended = scene.train(with(with(options, still), {"--patience", "30%", "-o", "run"}));
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  CHECK(steps_of("run") < 120);
  // The best one is the first that was judged.
  CHECK(sarnerf::read_model(scene / "run/model.pt").info.steps <= 21);
  CHECK(has(scene.train({"--resume", "run"}).err, "already done"));

  REQUIRE(scene.train(with(with(options, still), {"-o", "whole"})).code == 0);
  CHECK(steps_of("whole") == 200);
  CHECK(scene.train({"data", "-o", "other", "--patience", "soon"}).code == 2);
}
