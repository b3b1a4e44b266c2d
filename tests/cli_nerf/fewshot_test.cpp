// SPDX-License-Identifier: Apache-2.0
// sar_fewshot on simulated chips of three classes.
#include <csignal>
#include <map>

#include <nlohmann/json.hpp>

#include "catch.h"
#include "programs.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Chips of three solids at two depressions, one-look speckle over grass.
class ThreeClasses : public ScratchFolder {
 public:
  ThreeClasses() {
    for (const std::string name : {"cuboid", "platform_upright", "l_building"})
      for (const std::string depression : {"17", "15"}) {
        const Outcome o = run_program(SAR_RENDER,
                                      {DATA_FOLDER "/" + name + ".obj", "--scale", "0.4", "--depression", depression, "--azimuth",
                                       depression == "17" ? "0:345:15" : "7:345:30", "--size", "112x112", "--spacing", "0.2",
                                       "--slant-range", "4500", "--ground", "grass", "--looks", "1", "--resolution", "0.3", "--window",
                                       "taylor:-35", "--seed", depression, "-q", "-o", "chips/" + name + "/" + depression},
                                      path());
        INFO(o.err);
        REQUIRE(o.code == 0);
      }
  }

  /// A small study, with some options changed.
  Outcome run(const std::map<std::string, std::string>& changed, const Signal& signal = {}) const {
    std::map<std::string, std::string> options{
        {"--shots", "4"},   {"--draws", "2"},       {"--steps", "10"},  {"--batch", "8"}, {"--arms", "none,turned,learned"},
        {"--field", "grid"}, {"--field-steps", "10"}, {"--output", "study"}, {"--classifiers", "a-convnet,nearest,background"}};
    for (const auto& [name, value] : changed) options[name] = value;
    std::vector<std::string> all{"chips"};
    for (const auto& [name, value] : options) {
      all.push_back(name);
      if (!value.empty()) all.push_back(value);  // flags have none
    }
    return run_program(SAR_FEWSHOT, all, path(), signal);
  }
};

}  // namespace

TEST_CASE("a study of simulated chips has its tables, pictures and cells, continues, and refuses other options", "[fewshot]") {
  const ThreeClasses chips;
  // Stopped in the middle, it keeps what was finished.
  bool sent = false;
  const Outcome stopped = chips.run({}, [&](double) {
    if (sent || !fs::exists(chips / "study/cells/nearest_turned_04_00.json")) return 0;
    sent = true;  // a second signal would end it at once
    return SIGINT;
  });
  INFO(stopped.err);
  CHECK(stopped.code == 130);
  CHECK(stopped.is_error("the same command continues"));
  const auto first = fs::last_write_time(chips / "study/cells/a-convnet_none_04_00.json");

  const Outcome done = chips.run({});
  INFO(done.err);
  REQUIRE(done.code == 0);
  CHECK(fs::last_write_time(chips / "study/cells/a-convnet_none_04_00.json") == first);
  for (const char* file : {"report.md", "report.html", "a-convnet.png", "pictures/cuboid.png", "generated/04_01.pt"})
    CHECK(fs::exists(chips / "study" / file));
  CHECK(done.out.find("learned − turned") != std::string::npos);
  CHECK(done.out.find("four corners") != std::string::npos);

  const Json report = Json::parse(read_text(chips / "study/report.json"));
  CHECK(report.at("classes").size() == 3);
  // Three arms of two classifiers, and the background, of two draws.
  CHECK(report.at("cells").size() == 14);
  double nearest = 0.0;
  for (const Json& cell : report.at("cells")) {
    int n = 0;
    for (const Json& row : cell.at("confusion"))
      for (const int count : row) n += count;
    CHECK(n == 36);
    if (cell.at("classifier") == "nearest") nearest += cell.at("accuracy").get<double>() / 6.0;
  }
  CHECK(nearest > 0.6);  // chance is 0.33

  const Outcome again = chips.run({});
  CHECK(again.code == 0);
  CHECK(again.out == done.out);
  CHECK(chips.run({{"--rate", "0.001"}}).code == 2);
  CHECK(chips.run({{"--arms", "none,lerned"}}).is_error("learned?"));
  CHECK(chips.run({{"--classes", "cuboid,tank"}, {"--output", "other"}}).is_error("tank"));
  CHECK(chips.run({{"--shots", "40"}, {"--output", "other"}}).is_error("expected 40 chips or more at 17 deg"));
  CHECK(chips.run({{"--train-depression", "40"}, {"--test-depression", "45"}, {"--output", "other"}}).code == 3);
  CHECK(!fs::exists(chips / "other"));

  const Outcome exported = chips.run({{"--export", "exported"}, {"--export-draws", "draws"}, {"--draws", "1"}});
  INFO(exported.err);
  REQUIRE(exported.code == 0);
  CHECK(fs::exists(chips / "exported/04_00/learned/cuboid/generated_000.tif"));

  // The program for other machines makes the same cells of the file.
  const auto recognise = [&](const std::vector<std::string>& arguments) { return run_program(SAR_RECOGNISE, arguments, chips.path()); };
  const Outcome elsewhere = recognise({"draws/04_00.pt", "--classifier", "nearest", "--classifier", "a-convnet", "--arm", "learned"});
  INFO(elsewhere.err);
  REQUIRE(elsewhere.code == 0);
  const auto cell = [&](const std::string& file) { return Json::parse(read_text(chips / file)); };
  CHECK(cell("cells/nearest_learned_04_00.json").at("confusion") == cell("study/cells/nearest_learned_04_00.json").at("confusion"));
  fs::copy_file(chips / "cells/a-convnet_learned_04_00.json", chips / "study/cells/a-convnet_learned_04_00.json",
                fs::copy_options::overwrite_existing);
  CHECK(chips.run({}).code == 0);
  CHECK(recognise({"draws/04_00.pt", "--arm", "lerned"}).code == 1);
  CHECK(recognise({"study/report.json"}).is_error("is not a file of a draw of shots"));
  CHECK(recognise({"draws/04_00.pt", "--classifier", "resnet"}).code == 2);
  // The background: exchanged between test chips, and compared with that of measured chips.
  const Outcome exchanged = chips.run({{"--exchange-clutter", ""}, {"--arms", "none"}, {"--classifiers", "nearest,background"}, {"--draws", "1"},
                                       {"--output", "exchanged"}});
  INFO(exchanged.err);
  REQUIRE(exchanged.code == 0);
  CHECK(exchanged.out.find("across classes") != std::string::npos);
  const Json tested = cell("exchanged/cells/nearest_none_04_00.json");
  CHECK(tested.at("confusion") == cell("study/cells/nearest_none_04_00.json").at("confusion"));
  // What recognises the background fails where it is exchanged.
  const Json background = cell("exchanged/cells/background_none_04_00.json");
  CHECK(background.at("confusion_across") != background.at("confusion"));
  CHECK(fs::exists(chips / "exchanged/pictures/exchanged_background.png"));
  const Outcome compared = chips.run({{"--check-clutter", ""}});
  INFO(compared.err);
  CHECK(compared.code == 0);
  CHECK(compared.out.find("measured from generated: ") != std::string::npos);

  // Chips generated for another depression, at which two classes have none.
  for (const char* name : {"platform_upright", "l_building"}) fs::rename(chips / "chips" / name / "15", chips / (std::string(name) + "_15"));
  CHECK(chips.run({{"--output", "other"}}).is_error("--test-rest"));
  const Outcome rest = chips.run({{"--test-rest", ""}, {"--generate-depression", "45"}, {"--arms", "none,turned,rescaled,learned"},
                                  {"--classifiers", "nearest"}, {"--output", "rest"}});
  INFO(rest.err);
  CHECK(rest.code == 0);
  CHECK(rest.out.find("cuboid, 4 shots: false alarms") != std::string::npos);
  CHECK(cell("rest/cells/nearest_rescaled_04_00.json").at("confusion") != cell("rest/cells/nearest_turned_04_00.json").at("confusion"));
  for (const char* name : {"platform_upright", "l_building"}) fs::rename(chips / (std::string(name) + "_15"), chips / "chips" / name / "15");
  CHECK(chips.run({{"--shots", "20"}, {"--validate", ""}, {"--output", "validation"}}).is_error("expected 20 shots"));
  CHECK(chips.run({{"--dry-run", ""}}).out.find("14: classifiers") != std::string::npos);
}
