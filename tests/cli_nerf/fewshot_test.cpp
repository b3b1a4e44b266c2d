// SPDX-License-Identifier: Apache-2.0
// sar_fewshot on simulated chips of three classes.
#include <cmath>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>

#include <nlohmann/json.hpp>

#include "catch.h"
#include "programs.h"
#include "sarnerf/core/files.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/recognise/cell.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Chips of three solids at two depressions, one-look speckle over grass.
struct RenderedChips : ScratchFolder {
  RenderedChips() {
    for (const std::string name : {"cuboid", "platform_upright", "l_building"})
      for (const std::string depression : {"17", "15"}) {
        const Outcome o = run_program(SAR_RENDER,
                                      {DATA_FOLDER "/" + name + ".obj", "--scale", "0.4", "--depression", depression, "--azimuth",
                                       depression == "17" ? "0:345:15" : "7:345:30", "--size", "112x112", "--spacing", "0.2",
                                       "--slant-range", "4500", "--ground", "grass", "--looks", "1", "--resolution", "0.3", "--window",
                                       "taylor:-35", "--seed", depression, "-q", "-o", "chips/" + name + "/" + depression},
                                      {path()});
        INFO(o.err);
        REQUIRE(o.code == 0);
      }
  }
};

class ThreeClasses : public ScratchFolder {
 public:
  ThreeClasses() : ScratchFolder(filled_once<RenderedChips>().path()) {}

  /// A small study, with some options changed.
  Outcome run(const std::map<std::string, std::string>& changed, const Signal& signal = {}) const {
    std::map<std::string, std::string> options{
        {"--shots", "4"},   {"--draws", "2"},       {"--steps", "10"},  {"--batch", "8"}, {"--arms", "none,turned,learned"},
        {"--field", "grid"}, {"--field-steps", "10"}, {"--step", "10"}, {"--reach", "15"}, {"--output", "study"},
        {"--classifiers", "a-convnet,nearest,background"}};
    for (const auto& [name, value] : changed) options[name] = value;
    std::vector<std::string> all{"chips"};
    for (const auto& [name, value] : options) {
      all.push_back(name);
      if (!value.empty()) all.push_back(value);  // flags have none
    }
    return run_program(SAR_FEWSHOT, all, {path(), signal});
  }

  Json json(const std::string& file) const { return json_of(path() / file); }

  /// A table of the chips of these classes, with "azimuth,range" spacings (m).
  std::string table_of(const std::vector<std::string>& classes, const std::string& spacings_m) const {
    std::string table = "file,class,azimuth_deg,depression_deg,azimuth_spacing_m,range_spacing_m\n";
    for (const std::string& name : classes)
      for (const std::string depression : {"17", "15"}) {
        const std::string folder = name + "/" + depression;
        const Json dataset = json("chips/" + folder + "/dataset.json");
        for (const Json& view : dataset.at("views"))
          table += folder + "/" + view.at("image").get<std::string>() + "," + name + "," + std::to_string(view.at("azimuth_deg").get<double>()) + "," +
                   depression + "," + spacings_m + "\n";
      }
    return table;
  }

  /// Replaces a piece of a text file.
  void edit(const std::string& file, const std::string& piece, const std::string& instead) const {
    std::string text = read_text(path() / file);
    text.replace(text.find(piece), piece.size(), instead);
    std::ofstream(path() / file) << text;
  }
};

/// Test chips of a table of confusions.
int n_tested(const Json& confusion) {
  int n = 0;
  for (const Json& row : confusion)
    for (const int count : row) n += count;
  return n;
}

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
  for (const char* file : {"report.md", "report.html", "a-convnet.png", "pictures/cuboid.png", "generated/04_01_cuboid.pt"})
    CHECK(fs::exists(chips / "study" / file));
  CHECK(has(done.out, "learned − turned"));
  CHECK(has(done.out, "four corners"));

  const Json report = chips.json("study/report.json");
  CHECK(report.at("classes").size() == 3);
  // Three arms of two classifiers, and the background, of two draws.
  CHECK(report.at("cells").size() == 14);
  double nearest = 0.0;
  for (const Json& cell : report.at("cells")) {
    CHECK(n_tested(cell.at("confusion")) == 36);
    if (cell.at("classifier") == "nearest") nearest += cell.at("accuracy").get<double>() / 6.0;
  }
  CHECK(nearest > 0.6);  // chance is 0.33

  // A kept field that was damaged is learned again.
  std::ofstream(chips / "study/generated/04_00_cuboid.pt") << "no archive";
  fs::remove(chips / "study/cells/nearest_learned_04_00.json");
  const Outcome again = chips.run({});
  CHECK(again.code == 0);
  CHECK(again.out == done.out);
  // Pictures show the arms that are asked for.
  const auto picture = fs::file_size(chips / "study/pictures/cuboid.png");
  CHECK(chips.run({{"--arms", "none,turned"}}).code == 0);
  const auto smaller = fs::file_size(chips / "study/pictures/cuboid.png");
  CHECK(smaller < picture);
  CHECK(chips.run({{"--arms", "none"}}).code == 0);  // has no generated chips to show, and leaves the pictures alone
  CHECK(fs::file_size(chips / "study/pictures/cuboid.png") == smaller);

  // Other fields leave the cells of arms without one valid.
  REQUIRE(chips.run({{"--field-steps", "11"}, {"--speckle", "off"}, {"--draws", "1"}, {"--classifiers", "nearest"}, {"--output", "fields"}}).code == 0);
  const auto mark = [&](const std::string& folder, const std::string& arm) {
    return chips.json(folder + "/cells/nearest_" + arm + "_04_00.json").at("study").get<std::string>();
  };
  for (const char* arm : {"none", "turned"}) CHECK(mark("fields", arm) == mark("study", arm));
  CHECK(mark("study", "none") != mark("study", "turned"));
  CHECK(mark("fields", "learned") != mark("study", "learned"));

  // Cells and folders of other chips or options.
  CHECK(chips.run({{"--rate", "0.001"}}).code == 2);
  CHECK(chips.run({{"--classes", "cuboid,l_building"}}).is_error("other chips or options"));
  // One is refused before anything is trained.
  fs::remove(chips / "study/cells/a-convnet_none_04_00.json");
  chips.edit("study/cells/nearest_none_04_00.json", "\"study\": \"", "\"study\": \"0");
  const Outcome foreign = chips.run({});
  CHECK(foreign.code == 3);
  CHECK(foreign.is_error("remove the file"));
  CHECK_FALSE(fs::exists(chips / "study/cells/a-convnet_none_04_00.json"));
}

TEST_CASE("what a study cannot mean is refused before anything is written", "[fewshot]") {
  const ThreeClasses chips;
  const auto refused = [&](int code, const std::string& piece, std::map<std::string, std::string> changed) {
    changed["--output"] = "other";
    const Outcome outcome = chips.run(changed);
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK(outcome.is_error(piece));
    CHECK(!fs::exists(chips / "other"));
  };
  refused(2, "learned?", {{"--arms", "none,lerned"}});
  refused(2, "given twice", {{"--arms", "none,none"}});
  refused(2, "given twice", {{"--shots", "4,4"}});
  refused(2, "--generate-depression", {{"--arms", "none,rescaled"}});
  refused(2, "--test-rest", {{"--arms", "none,measured"}, {"--test-rest", ""}});
  refused(2, "leave out", {{"--check-clutter", ""}, {"--speckle", "nearest"}});
  refused(2, "add none", {{"--classifiers", "nearest,background"}, {"--arms", "turned"}});
  refused(2, "does not rescale", {{"--arms", "none,interpolated"}, {"--interpolation", "linear"}, {"--generate-depression", "30"}});
  refused(2, "does not rescale", {{"--arms", "none,interpolated+turned"}, {"--interpolation", "linear"}, {"--generate-depression", "30"}});
  refused(2, "found all", {{"--check-clutter", ""}, {"--shots", "all"}});
  refused(2, "--max-memory allows 100 MiB", {{"--max-memory", "100M"}});
  refused(2, "--csv", {{"--amplitude-scale", "2"}});
  refused(2, "leave out --check-clutter", {{"--check-clutter", ""}, {"--export", "exported"}});
  refused(2, "or all", {{"--shots", "4,al"}});
  refused(2, "nominal", {{"--test-depression", "16"}});
  refused(2, "tank", {{"--classes", "cuboid,tank"}});
  refused(3, "expected 40 chips or more at 17 deg", {{"--shots", "40"}});
  refused(3, "found none", {{"--train-depression", "40"}, {"--test-depression", "45"}});
  refused(2, "expected 20 shots", {{"--shots", "4,20"}, {"--validate", ""}});
  CHECK(has(chips.run({{"--dry-run", ""}}).out, "14: classifiers"));
}

TEST_CASE("chips and draws are exported, and sar_recognise makes the same cells of them", "[fewshot]") {
  const ThreeClasses chips;
  REQUIRE(chips.run({{"--classifiers", "nearest"}, {"--draws", "1"}, {"--exchange-clutter", ""}}).code == 0);
  const std::map<std::string, std::string> both{{"--export", "exported"}, {"--export-draws", "draws"}, {"--draws", "1"}, {"--exchange-clutter", ""}};
  const Outcome exported = chips.run(both);
  INFO(exported.err);
  REQUIRE(exported.code == 0);
  CHECK(fs::exists(chips / "exported/04_00/learned/cuboid/generated_000.tif"));
  // Shots lie at multiples of 15 degrees, 90 apart, and generated chips 10 degrees on either side of them.
  std::istringstream table(read_text(chips / "exported/04_00/learned/chips.csv"));
  std::string line;
  std::getline(table, line);
  CHECK(line == "file,class,azimuth_deg,depression_deg,azimuth_spacing_m,range_spacing_m");
  std::map<std::string, int> n_at;  // chips of the cuboid by kind and azimuth
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::string file, name, azimuth, depression;
    for (std::string* field : {&file, &name, &azimuth, &depression}) std::getline(fields, *field, ',');
    CHECK(fs::exists(chips / "exported/04_00/learned" / file));
    CHECK(file.find(name + "/") == 0);
    CHECK(depression == "17.0000");
    if (name == "cuboid") ++n_at[(has(file, "shot") ? "shot " : "generated ") + std::to_string(std::lround(std::fmod(std::stod(azimuth), 90.0)))];
  }
  REQUIRE(n_at.size() == 3);
  for (const auto& [azimuth, n] : n_at) CHECK(n == 4);
  CHECK(chips.run(both).code == 0);
  CHECK(chips.run({{"--export", "exported"}, {"--step", "7"}, {"--output", "seven"}}).is_error("--export"));

  const auto recognise = [&](const std::vector<std::string>& arguments) { return run_program(SAR_RECOGNISE, arguments, {chips.path()}); };
  const std::vector<std::string> arguments{"draws/04_00.pt", "--classifier", "nearest", "--classifier", "a-convnet", "--arm", "learned"};
  const Outcome elsewhere = recognise(arguments);
  INFO(elsewhere.err);
  REQUIRE(elsewhere.code == 0);
  for (const char* part : {"confusion", "confusion_within", "confusion_across"})
    CHECK(chips.json("cells/nearest_learned_04_00.json").at(part) == chips.json("study/cells/nearest_learned_04_00.json").at(part));
  fs::copy_file(chips / "cells/a-convnet_learned_04_00.json", chips / "study/cells/a-convnet_learned_04_00.json");
  chips.edit("study/cells/a-convnet_learned_04_00.json", "\"device\": \"cpu", "\"device\": \"cuda");
  const Outcome joined = chips.run({{"--draws", "1"}, {"--exchange-clutter", ""}});
  CHECK(joined.code == 0);
  CHECK(has(joined.out, "Trained on different devices"));
  CHECK(recognise(arguments).out.empty());  // nothing is made again
  // Cells are enough for a report.
  REQUIRE(recognise({"draws/04_00.pt", "--classifier", "nearest", "--arm", "none", "-o", "published/cells"}).code == 0);
  const auto made = fs::last_write_time(chips / "published/cells/nearest_none_04_00.json");
  const std::map<std::string, std::string> published{{"--draws", "1"}, {"--exchange-clutter", ""}, {"--arms", "none"}, {"--classifiers", "nearest"},
                                                     {"--output", "published"}};
  auto other = published;
  other["--classes"] = "cuboid,l_building";
  CHECK(chips.run(other).is_error("other"));
  CHECK_FALSE(fs::exists(chips / "published/recipe.json"));  // so that the right command is taken
  other = published;
  other["--export"] = "published";
  CHECK(chips.run(other).is_error("found other files"));
  std::ofstream(chips / "published/a_file") << "";
  CHECK(chips.run(published).is_error("found other files"));
  fs::remove(chips / "published/a_file");
  const Outcome tables = chips.run(published);
  INFO(tables.err);
  CHECK(tables.code == 0);
  CHECK(fs::last_write_time(chips / "published/cells/nearest_none_04_00.json") == made);
  // A cell that was cut off while it was copied, and one of another study: found before a training.
  fs::remove(chips / "cells/a-convnet_learned_04_00.json");
  const std::string whole = read_text(chips / "cells/nearest_learned_04_00.json");
  std::ofstream(chips / "cells/nearest_learned_04_00.json") << whole.substr(0, whole.find("\"confusion_across"));
  CHECK(recognise(arguments).is_error("a part of one"));
  std::ofstream(chips / "cells/nearest_learned_04_00.json") << whole;
  chips.edit("cells/nearest_learned_04_00.json", "\"study\": \"", "\"study\": \"0");
  const Outcome foreign = recognise({"draws/04_00.pt", "--classifier", "a-convnet", "--classifier", "nearest", "--arm", "learned"});
  CHECK(foreign.code == 3);
  CHECK(foreign.is_error("other chips or options"));
  CHECK_FALSE(fs::exists(chips / "cells/a-convnet_learned_04_00.json"));
  const Outcome no_arm = recognise({"draws/04_00.pt", "--arm", "lerned"});
  CHECK(no_arm.code == 2);
  CHECK(no_arm.is_error("lerned"));
  std::ofstream(chips / "a_file") << "";
  CHECK(recognise({"draws/04_00.pt", "-o", "a_file"}).code == 1);
  CHECK(recognise({"study/report.json"}).code == 3);
  CHECK(recognise({"study/report.json"}).is_error("is not a file of a draw of shots"));
  CHECK(recognise({"draws/04_00.pt", "study/report.json", "-o", "early"}).is_error("is not a file of a draw of shots"));
  CHECK_FALSE(fs::exists(chips / "early"));  // found before the first training
  CHECK(recognise({"draws/04_00.pt", "--classifier", "resnet"}).code == 2);
}

TEST_CASE("chips that are there twice, datasets without a class, and a table with other spacings are refused", "[fewshot]") {
  const ThreeClasses chips;
  fs::copy(chips / "chips/cuboid/17", chips / "chips/cuboid/again", fs::copy_options::recursive);
  const Outcome twice = chips.run({});
  CHECK(twice.code == 3);
  CHECK(twice.is_error("expected each chip once"));
  const Outcome no_class = run_program(SAR_FEWSHOT, {"chips/cuboid/17", "--output", "study"}, {chips.path()});
  CHECK(no_class.code == 3);
  CHECK(no_class.is_error("named after its class"));
  CHECK_FALSE(fs::exists(chips / "study"));
  fs::remove_all(chips / "chips/cuboid/again");

  const auto with_spacings = [&](const std::string& spacings) {
    std::ofstream(chips / "table.csv") << chips.table_of({"cuboid", "l_building"}, spacings);
    return chips.run({{"--csv", "table.csv"}, {"--amplitude-scale", "1"}, {"--arms", "none"}, {"--classifiers", "nearest"}, {"--draws", "1"}});
  };
  CHECK(with_spacings("0.2,0.21").code == 0);
  const Outcome swapped = with_spacings("0.21,0.2");
  CHECK(swapped.code == 2);
  CHECK(swapped.is_error("geometry"));
}

TEST_CASE("a quick look has four classes, three arms and one draw, and keeps what is given", "[fewshot]") {
  const ThreeClasses chips;
  const Outcome quick = run_program(SAR_FEWSHOT, {"chips", "--quick", "--steps", "2", "--batch", "4", "--field-steps", "2", "--step", "10", "--output", "quick"},
                                    {chips.path()});
  INFO(quick.err);
  REQUIRE(quick.code == 0);
  const Json report = chips.json("quick/report.json");
  CHECK(report.at("cells").size() == 3 + 3 + 1);
  CHECK(report.at("request").at("classifiers").at("steps") == 2);
  CHECK(report.at("request").at("generated").at("learned").at("steps") == 2);
}

TEST_CASE("shots of all classes lie at the same azimuths if that is asked for", "[fewshot]") {
  const ThreeClasses chips;
  for (const char* name : {"l_building", "platform_upright"}) {  // three names of one solid: the same azimuth is the same chip
    fs::remove_all(chips / "chips" / name);
    fs::copy(chips / "chips/cuboid", chips / "chips" / name, fs::copy_options::recursive);
  }
  const auto classes_agree = [&](const std::string& folder, std::map<std::string, std::string> changed) {
    changed.insert({{"--draws", "1"}, {"--arms", "none"}, {"--export-draws", folder}, {"--output", folder + "_study"}});
    const Outcome outcome = chips.run(changed);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    const sarnerf::LabelledChips shots = sarnerf::read_draw_file((chips / folder / "04_00.pt").string()).shots;
    REQUIRE(shots.size() == 3 * 4);
    const auto of_class = [&](int c) { return shots.amplitude.index_select(0, torch::nonzero(shots.label == c).flatten()); };
    return torch::equal(of_class(0), of_class(1)) && torch::equal(of_class(0), of_class(2));
  };
  CHECK(classes_agree("same", {{"--same-azimuths", ""}}));
  CHECK_FALSE(classes_agree("own", {}));
  CHECK(chips.run({{"--same-azimuths", ""}, {"--output", "own_study"}}).is_error("other chips or options"));
}

TEST_CASE("generated chips divide the gaps evenly, and measured ones are no test chips", "[fewshot]") {
  const ThreeClasses chips;
  const auto draw = [&](const std::string& folder, std::map<std::string, std::string> changed) {
    changed.insert({{"--draws", "1"}, {"--classifiers", "nearest"}, {"--export-draws", folder}, {"--output", folder + "_study"}});
    const Outcome outcome = chips.run(changed);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return sarnerf::read_draw_file((chips / folder / "04_00.pt").string());
  };
  // Gaps of 90°, more or less, by 5°; within 15° of either shot.
  const auto near = draw("near", {{"--arms", "turned,turned-both,turned-360,turned-clutter,turned-clutter+turned,interpolated,interpolated+turned"}, {"--step", "5"}}).generated;
  CHECK(near.at("turned").chips.size() == 3 * 4 * 6);
  CHECK(near.at("turned-360").chips.size() == 3 * 4 * 23);
  const auto of_both = [&](int first) { return near.at("turned-both").chips.amplitude.slice(0, first, near.at("turned-both").chips.size(), 2); };
  CHECK(torch::equal(of_both(0), near.at("turned").chips.amplitude));
  CHECK(of_both(1).sizes() == of_both(0).sizes());
  CHECK_FALSE(torch::allclose(of_both(1), of_both(0), 0.1));
  CHECK(torch::equal(near.at("interpolated+turned").chips.amplitude,
                     torch::cat({near.at("interpolated").chips.amplitude, near.at("turned").chips.amplitude})));
  // The same targets on other clutter.
  const torch::Tensor &turned_shots = near.at("turned").chips.amplitude, &on_clutter = near.at("turned-clutter").chips.amplitude;
  CHECK(torch::equal(near.at("turned-clutter+turned").chips.amplitude, torch::cat({on_clutter, turned_shots})));
  const auto middle = [](const torch::Tensor& amplitude) { return amplitude.slice(1, 48, 56).slice(2, 48, 56); };
  const auto first_corner = [](const torch::Tensor& amplitude) { return amplitude.slice(1, 0, 16).slice(2, 0, 16); };
  CHECK(torch::allclose(middle(on_clutter), middle(turned_shots), 1e-6));
  CHECK(std::abs(torch::corrcoef(torch::stack({first_corner(on_clutter).flatten(), first_corner(turned_shots).flatten()}))[0][1].item<double>()) < 0.2);
  CHECK(first_corner(on_clutter).square().mean().item<double>() == Approx(first_corner(turned_shots).square().mean().item<double>()).epsilon(0.1));
  CHECK(draw("nearer", {{"--arms", "turned"}, {"--step", "5"}, {"--reach", "5.1"}}).generated.at("turned").chips.size() == 3 * 4 * 2);
  const auto whole = draw("whole", {{"--arms", "turned,interpolated"}, {"--step", "5"}, {"--reach", "180"}}).generated;
  for (const char* arm : {"turned", "interpolated"}) {
    INFO(arm);
    CHECK(whole.at(arm).chips.size() == 3 * (72 - 4));
    // Chips of 112 pixels have no room for turns of 45°: their edges are mirrored, and no corner is black.
    const torch::Tensor corner = whole.at(arm).chips.amplitude.slice(1, 0, 8).slice(2, 0, 8).amax({1, 2});
    CHECK(corner.min().item<float>() > 0.0f);
  }

  // Turned shots, corrected by a field.
  const sarnerf::DrawFile both = draw("corrected", {{"--arms", "turned,corrected"}});
  const sarnerf::LabelledChips &turned = both.generated.at("turned").chips, &corrected = both.generated.at("corrected").chips;
  REQUIRE(corrected.size() == turned.size());
  CHECK(torch::equal(corrected.label, turned.label));
  CHECK_FALSE(torch::allclose(corrected.amplitude, turned.amplitude, 0.1));
  CHECK(corrected.amplitude.square().mean().item<double>() == Approx(turned.amplitude.square().mean().item<double>()).epsilon(0.3));

  // With the clutter of the nearest shots, learned chips show the ground of turned ones; with that of any shot, other ground. After wider
  // turns the edges of both are mirror images, of a chip with its target and of one without.
  const auto ground_in_common = [&](const sarnerf::DrawFile& file) {
    const auto edge = [&](const char* arm) { return file.generated.at(arm).chips.amplitude.slice(2, 0, 16).flatten(); };
    return torch::corrcoef(torch::stack({edge("learned"), edge("turned")}))[0][1].item<double>();
  };
  CHECK(ground_in_common(draw("nearest", {{"--arms", "turned,learned"}, {"--speckle", "nearest"}})) > 0.9);
  const sarnerf::DrawFile any = draw("any", {{"--arms", "turned,learned"}});
  CHECK(std::abs(ground_in_common(any)) < 0.1);
  // Targets fluctuate as one-look speckle of mean 1 does: its mean square is 2.
  const auto learned_power = [&](const char* name, const char* speckle) {
    return draw(name, {{"--arms", "learned"}, {"--step", "2"}, {"--speckle", speckle}}).generated.at("learned").chips.amplitude.square();
  };
  const torch::Tensor mean = learned_power("mean", "off"), of_learned = learned_power("speckled", "shots");
  const torch::Tensor is_target = mean > 10.0 * mean.median(), factors = of_learned / mean, factor = factors.masked_select(is_target);
  REQUIRE(factor.numel() > 500);
  CHECK(factor.mean().item<double>() == Approx(1.0).epsilon(0.1));
  CHECK(factor.square().mean().item<double>() == Approx(2.0).epsilon(0.2));
  // No two views have a fluctuation in common: a class could be known by it.
  int n_pairs = 0;
  for (std::int64_t a = 0; a < factors.size(0); ++a)
    for (std::int64_t b = a + 1; b < factors.size(0); ++b) {
      const torch::Tensor shared = is_target[a] & is_target[b];
      if (shared.sum().item<std::int64_t>() < 100) continue;
      CHECK(torch::corrcoef(torch::stack({factors[a].masked_select(shared), factors[b].masked_select(shared)}))[0][1].item<double>() < 0.6);
      ++n_pairs;
    }
  CHECK(n_pairs > 200);

  const sarnerf::DrawFile validation = draw("validation", {{"--arms", "measured"}, {"--validate", ""}, {"--reach", "180"}});
  const sarnerf::LabelledChips& measured = validation.generated.at("measured").chips;
  CHECK(measured.size() > 0);
  // No test chip is learned from, as a shot or as a measured chip.
  const auto in_common = [](const sarnerf::LabelledChips& learned, const sarnerf::LabelledChips& tested) {
    REQUIRE(tested.size() > 0);
    int n = 0;
    for (std::int64_t t = 0; t < tested.size(); ++t) n += (learned.amplitude == tested.amplitude[t]).flatten(1).all(1).any().item<bool>();
    return n;
  };
  CHECK(in_common(measured, validation.test.measured) == 0);
  CHECK(in_common(validation.shots, validation.test.measured) == 0);
  for (const char* name : {"platform_upright", "l_building"}) fs::remove_all(chips / "chips" / name / "15");
  const sarnerf::DrawFile rest = draw("rest", {{"--arms", "none"}, {"--test-rest", ""}});
  CHECK(rest.test.measured.size() == 12 + 2 * 20);
  CHECK(in_common(rest.shots, rest.test.measured) == 0);
  // A validation needs no chips at another depression.
  fs::remove_all(chips / "chips" / "cuboid" / "15");
  const sarnerf::DrawFile alone = draw("alone", {{"--arms", "none"}, {"--validate", ""}});
  CHECK(torch::equal(alone.shots.amplitude, validation.shots.amplitude));
  CHECK(torch::equal(alone.test.measured.amplitude, validation.test.measured.amplitude));
}

TEST_CASE("backgrounds are exchanged between test chips, and compared with generated ones", "[fewshot]") {
  const ThreeClasses chips;
  const Outcome exchanged = chips.run({{"--exchange-clutter", ""}, {"--arms", "none,turned"}, {"--classifiers", "nearest,background"}, {"--draws", "1"}});
  INFO(exchanged.err);
  REQUIRE(exchanged.code == 0);
  CHECK(has(exchanged.out, "across classes"));
  // Arms are compared on measured and on exchanged backgrounds.
  const auto accuracy_across = [&](const char* cell) {
    double right = 0.0;
    const Json confusion = chips.json(std::string("study/cells/nearest_") + cell + "_04_00.json").at("confusion_across");
    for (std::size_t c = 0; c < confusion.size(); ++c) right += confusion[c][c].get<double>();
    return 100.0 * right / n_tested(confusion);
  };
  const Json differences = chips.json("study/report.json").at("differences");
  REQUIRE(differences.size() == 2);
  CHECK(differences[0].at("measure") == "accuracy");
  CHECK(differences[1].at("measure") == "On the background of another class");
  CHECK(differences[1].at("points").get<double>() == Approx(accuracy_across("turned") - accuracy_across("none")).margin(1e-9));
  REQUIRE(chips.run({{"--arms", "none"}, {"--classifiers", "nearest"}, {"--draws", "1"}, {"--output", "plain"}}).code == 0);
  CHECK(chips.json("study/cells/nearest_none_04_00.json").at("confusion") == chips.json("plain/cells/nearest_none_04_00.json").at("confusion"));
  // What sees the background alone answers otherwise. (All classes stand on the same grass here: it recognises nothing.)
  const Json background = chips.json("study/cells/background_none_04_00.json");
  CHECK(background.at("confusion_across") != background.at("confusion"));
  CHECK(has(exchanged.out, "## background"));
  CHECK(fs::exists(chips / "study/pictures/exchanged_background.png"));
  const Outcome compared = chips.run({{"--check-clutter", ""}, {"--output", "compared"}});
  INFO(compared.err);
  CHECK(compared.code == 0);
  CHECK(has(compared.out, "measured from generated: "));
  // Standard errors need three classes.
  CHECK(has(compared.out, " ± "));
  const Outcome two = chips.run({{"--check-clutter", ""}, {"--classes", "cuboid,l_building"}, {"--output", "two"}});
  CHECK(two.code == 0);
  CHECK_FALSE(has(two.out, " ± "));
}

TEST_CASE("ground that test chips have in common with training chips is found", "[fewshot]") {
  const ThreeClasses chips;
  // Each chip is listed at 17 degrees, and once more at 15.
  std::string table = "file,class,azimuth_deg,depression_deg,azimuth_spacing_m,range_spacing_m\n";
  for (const std::string name : {"cuboid", "platform_upright", "l_building"}) {
    const Json dataset = chips.json("chips/" + name + "/17/dataset.json");
    fs::create_directories(chips / "chips/again" / name);
    for (const Json& view : dataset.at("views")) {
      const auto image = view.at("image").get<std::string>();
      const std::string again = "again/" + name + "/" + fs::path(image).filename().string();
      fs::copy_file(chips / "chips" / name / "17" / image, chips / "chips" / again);
      const std::string rest = "," + name + "," + std::to_string(view.at("azimuth_deg").get<double>());
      table += name + "/17/" + image + rest + ",17,0.2,0.2\n" + again + rest + ",15,0.2,0.2\n";
    }
  }
  std::ofstream(chips / "table.csv") << table;
  const Outcome ground = chips.run({{"--csv", "table.csv"}, {"--amplitude-scale", "1"}, {"--check-ground", ""}});
  INFO(ground.err << ground.out);
  REQUIRE(ground.code == 0);
  std::string all = ground.out.substr(ground.out.find("| all "));
  all.resize(all.find('\n'));
  std::erase(all, ' ');
  const std::string expected = "|all|1.000|–|";  // chips are 15 degrees apart: none at 10
  REQUIRE(all.substr(0, expected.size()) == expected);
  CHECK(std::abs(std::stod(all.substr(expected.size()))) < 0.2);  // at 90 degrees speckle is another
  CHECK(fs::exists(chips / "study/ground.md"));
  CHECK(chips.run({{"--check-ground", ""}, {"--validate", ""}}).is_error("--validate"));
}

TEST_CASE("chips of several sizes are cut to the smallest", "[fewshot]") {
  const ThreeClasses chips;
  const auto study = [&](const std::string& output) {
    const Outcome outcome =
        chips.run({{"--exchange-clutter", ""}, {"--arms", "none"}, {"--classifiers", "nearest,background"}, {"--draws", "1"}, {"--output", output}});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return chips.json(output + "/cells/nearest_none_04_00.json").at("accuracy").get<double>();
  };
  CHECK(study("equal") > 0.6);
  // One class again, in larger chips of the same views.
  fs::remove_all(chips / "chips/cuboid");
  for (const std::string depression : {"17", "15"}) {
    const Outcome larger = run_program(SAR_RENDER, {DATA_FOLDER "/cuboid.obj", "--scale", "0.4", "--depression", depression, "--azimuth",
                                                    depression == "17" ? "0:345:15" : "7:345:30", "--size", "120x124", "--spacing", "0.2", "--slant-range",
                                                    "4500", "--ground", "grass", "--looks", "1", "--resolution", "0.3", "--window", "taylor:-35", "--seed",
                                                    depression, "-q", "-o", "chips/cuboid/" + depression}, {chips.path()});
    INFO(larger.err);
    REQUIRE(larger.code == 0);
  }
  CHECK(study("mixed") > 0.6);
  const Json background = chips.json("mixed/cells/background_none_04_00.json");
  CHECK(n_tested(background.at("confusion_across")) == 36);
  CHECK(background.at("confusion_across")[0] != background.at("confusion")[0]);  // the larger chips get the background of others
}

TEST_CASE("images that a table lists are studied like datasets", "[fewshot]") {
  const ThreeClasses chips;
  std::string table = chips.table_of({"cuboid", "platform_upright", "l_building"}, "0.2,0.2");
  const std::string first = chips.json("chips/cuboid/17/dataset.json").at("views")[0].at("image");
  fs::copy_file(chips / ("chips/cuboid/17/" + first), chips / "chips/other.tif");
  table += "other.tif,cuboid,0,30,0.2,0.2\n";
  std::ofstream(chips / "table.csv") << table;
  const std::map<std::string, std::string> small{{"--draws", "1"}, {"--arms", "none"}, {"--classifiers", "nearest"}};
  std::map<std::string, std::string> listed = small;
  listed.insert({{"--csv", "table.csv"}, {"--amplitude-scale", "1"}, {"--output", "listed"}});
  const Outcome outcome = chips.run(listed);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(has(outcome.err, "1 chip at other depressions left out"));
  const Outcome folders = chips.run(small);
  REQUIRE(folders.code == 0);
  CHECK_FALSE(has(folders.err, "left out"));
  const Json confusion = chips.json("listed/cells/nearest_none_04_00.json").at("confusion");
  CHECK(confusion.size() == 3);
  CHECK(n_tested(confusion) == 36);
  std::ofstream(chips / "table.csv") << table.substr(0, table.find(",azimuth_spacing_m")) << table.substr(table.find('\n'));
  listed["--output"] = "short";
  CHECK(chips.run(listed).is_error("table.csv"));
  std::string apart = table;  // a class that would be a folder of its own
  for (std::size_t at = 0; (at = apart.find(",cuboid,", at)) != std::string::npos;) apart.replace(at, 8, ",../cuboid,");
  std::ofstream(chips / "table.csv") << apart;
  const Outcome outside = chips.run(listed);
  CHECK(outside.code == 3);
  CHECK(outside.is_error("../cuboid"));
  CHECK(!fs::exists(chips / "short"));
}

TEST_CASE("several numbers of shots are corrected for, all chips are compared with nothing, and joined arms are shown in parts", "[fewshot]") {
  const ThreeClasses chips;
  const Outcome done = chips.run({{"--shots", "2,4,all"}, {"--arms", "none,turned,interpolated+turned"}, {"--classifiers", "nearest"}});
  INFO(done.err);
  REQUIRE(done.code == 0);
  CHECK(has(done.out, "draws differ by the seed alone"));
  CHECK(has(done.err, "nearest, turned, all shots, draw 1"));
  std::map<std::string, std::map<int, Json>> by_pair;
  const Json report = chips.json("study/report.json");
  for (const Json& d : report.at("differences"))
    by_pair[d.at("arm").get<std::string>() + " - " + d.at("reference").get<std::string>()][d.at("shots")] = d;
  REQUIRE(by_pair.size() == 3);
  for (const auto& [pair, by_shots] : by_pair) {
    INFO(pair);
    REQUIRE(by_shots.size() == 2);
    REQUIRE(by_shots.count(0) == 0);
    // Two draws: Student's t of one degree of freedom has its p in closed form, and the smaller one counts twice.
    const auto p = [&](int shots) {
      const Json& d = by_shots.at(shots);
      const double half_width = 0.5 * (d.at("high").get<double>() - d.at("low").get<double>());
      if (half_width == 0.0) return d.at("points") == 0.0 ? 1.0 : 0.0;
      return 1.0 - 2.0 / M_PI * std::atan(std::abs(d.at("points").get<double>()) / half_width * std::tan(0.475 * M_PI));
    };
    const int first = p(2) <= p(4) ? 2 : 4, second = 6 - first;
    const double expected = std::min(1.0, 2.0 * p(first));
    CHECK(by_shots.at(first).at("p_holm").get<double>() == Approx(expected).margin(1e-6));
    CHECK(by_shots.at(second).at("p_holm").get<double>() == Approx(std::max(expected, p(second))).margin(1e-6));
  }
  // Rows of the picture: measured, turned, interpolated.
  CHECK(sarnerf::read_image_size(chips / "study/pictures/cuboid.png").n_rows == 3 * (104 + 2));
  const auto page = [&] { return sarnerf::read_whole_file(chips / "study/report.md"); };
  CHECK(has(page(), "From above: measured chips, turned, interpolated;"));
  // Nothing is generated for all chips; pictures of other commands are none of this report.
  REQUIRE(chips.run({{"--shots", "all"}, {"--arms", "none"}, {"--classifiers", "nearest"}}).code == 0);
  CHECK_FALSE(has(page(), "Generated chips"));
}

TEST_CASE("chips are generated for another depression, at which some classes have none", "[fewshot]") {
  const ThreeClasses chips;
  for (const char* name : {"platform_upright", "l_building"}) fs::remove_all(chips / "chips" / name / "15");
  CHECK(chips.run({}).is_error("--test-rest"));
  const Outcome rest = chips.run({{"--test-rest", ""}, {"--generate-depression", "45"}, {"--arms", "none,turned,rescaled,learned"},
                                  {"--classifiers", "nearest"}, {"--draws", "1"}});
  INFO(rest.err);
  CHECK(rest.code == 0);
  CHECK(has(rest.out, "cuboid recognised, 4 shots"));
  CHECK(has(rest.out, "cuboid, false alarms:"));
  const Json differences = chips.json("study/report.json").at("differences");
  CHECK(!differences.empty());
  for (const Json& difference : differences) CHECK(difference.at("measure") != "accuracy");
  // 12 chips at 15 degrees of one class; of the others all 24 at 17 degrees but four shots.
  CHECK(n_tested(chips.json("study/cells/nearest_rescaled_04_00.json").at("confusion")) == 12 + 2 * 20);
  CHECK(chips.json("study/cells/nearest_rescaled_04_00.json").at("confusion") != chips.json("study/cells/nearest_turned_04_00.json").at("confusion"));
}
