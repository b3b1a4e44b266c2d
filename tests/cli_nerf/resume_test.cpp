// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <random>

#include "../nerf/torch_catch.h"
#include "programs.h"
#include "sarnerf/core/files.h"
#include "sarnerf/nerf/model_file.h"

namespace {

/// Sends the signal once a run has written this many lines of metrics.
Signal after_lines(const std::filesystem::path& metrics, int n_lines, int number) {
  return [=, sent = false](double) mutable {
    if (sent || !std::filesystem::exists(metrics)) return 0;
    const std::string text = read_text(metrics);
    if (std::count(text.begin(), text.end(), '\n') < n_lines) return 0;
    sent = true;
    return number;
  };
}

/// Sends the signal once, when the file is written anew.
Signal after_change(const std::filesystem::path& file, int number) {
  return [=, before = std::filesystem::last_write_time(file), sent = false](double) mutable {
    if (sent || std::filesystem::last_write_time(file) == before) return 0;
    sent = true;
    return number;
  };
}

}  // namespace

TEST_CASE("an interrupted run goes on bit by bit") {
  const SmallScene scene;
  const std::vector<std::string> options{"data", "--steps", "120", "--threads", "1", "-q"};
  const auto with_output = [&](const char* name) { return with(options, {"-o", name}); };
  REQUIRE(scene.train(with_output("whole")).code == 0);

  const Outcome stopped =
      scene.train(with_output("parts"), after_lines(scene / "parts/metrics.jsonl", 3, SIGTERM));
  REQUIRE(stopped.code == 130);
  CHECK(stopped.is_error("sar_nerf_train --resume parts continues"));
  CHECK(stopped.out.empty());
  CHECK(read_text(scene / "parts/model.pt") != read_text(scene / "whole/model.pt"));
  CHECK_FALSE(std::filesystem::exists(scene / "parts/report.json"));

  SECTION("by --resume") {
    const Outcome resumed = scene.train({"--resume", "parts", "--threads", "1"});
    CHECK(resumed.code == 0);
    CHECK(resumed.out == "parts\n");
    CHECK(has(resumed.err, "continuing after"));
  }
  SECTION("by the same command") { CHECK(scene.train(with_output("parts")).code == 0); }
  CHECK(read_text(scene / "parts/model.pt") == read_text(scene / "whole/model.pt"));
  CHECK(read_text(scene / "parts/config.toml") == read_text(scene / "whole/config.toml"));

  const Outcome again = scene.train({"--resume", "parts"});
  CHECK(again.code == 0);
  CHECK(has(again.err, "already done"));
  CHECK(scene.train({"--resume", "parts", "--steps", "100"}).code == 2);
  CHECK(scene.train({"--resume", "parts", "--seed", "2"}).is_error("seed: 1 there, 2 now"));
  REQUIRE(scene.train({"--resume", "parts", "--steps", "130"}).code == 0);
  CHECK(sarnerf::read_model(scene / "parts/model.pt").info.steps == 130);
  CHECK(has(scene.train({"--resume", "parts"}).err, "already done"));

  REQUIRE(scene.train({"--config", "whole/config.toml", "-o", "repeated", "--threads", "1"}).code ==
          0);
  CHECK(read_text(scene / "repeated/model.pt") == read_text(scene / "whole/model.pt"));
}

TEST_CASE("a damaged model of a finished run is made again, with the same bytes") {
  const SmallScene scene(6);
  const std::vector<std::string> command{"data", "-o", "run", "--steps", "30", "--threads", "1"};
  REQUIRE(scene.train(command).code == 0);
  const std::string model = read_text(scene / "run/model.pt");
  std::string damaged = model;
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  for (const std::string& bytes : {model.substr(0, model.size() / 2), damaged, std::string()}) {
    write_text(scene / "run/model.pt", bytes);
    const Outcome again = scene.train(command);
    INFO(again.err);
    CHECK(again.code == 0);
    CHECK_FALSE(has(again.err, "already done"));
    CHECK(has(again.err, "missing or damaged: they are made again"));
    CHECK(read_text(scene / "run/model.pt") == model);
  }
  CHECK(has(scene.train(command).err, "already done"));
}

TEST_CASE("a run that is killed at any instant leaves a checkpoint that loads, and goes on") {
  const SmallScene scene(4);
  std::mt19937 random(7);
  // Longer than a second: then the second checkpoint is written.
  std::uniform_real_distribution<double> delay(0.0, 1.2);
  const auto metrics = scene / "run/metrics.jsonl";
  const auto written = [&] {
    std::error_code ignored;
    return std::filesystem::last_write_time(metrics, ignored);
  };
  int n_loaded = 0;
  for (int n = 0; n < 12; ++n) {
    // Where start-up ends differs from machine to machine: the instant counts from the first line of this program.
    const auto before = written();
    const double delay_s = delay(random);
    double began_s = -1.0;
    const Outcome killed = scene.train(
        {"data", "-o", "run", "--steps", "100000", "--threads", "1", "-q"}, [&](double age_s) {
          if (began_s < 0.0 && written() != before) began_s = age_s;
          return began_s >= 0.0 && age_s > began_s + delay_s ? SIGKILL : 0;
        });
    INFO(killed.err);
    REQUIRE(killed.code == -SIGKILL);
    const auto checkpoint = scene / "run/checkpoints/latest.pt";
    if (!std::filesystem::exists(checkpoint)) continue;
    CHECK_NOTHROW(sarnerf::read_archive(checkpoint));
    CHECK_NOTHROW(sarnerf::restore_field(sarnerf::read_archive(checkpoint), "latest.pt"));
    ++n_loaded;
  }
  CHECK(n_loaded >= 6);
  const Outcome last =
      scene.train({"--resume", "run", "--time", "10000s"}, after_change(metrics, SIGINT));
  CHECK(last.code == 130);
  // Steps were saved, and came from one program to the next.
  CHECK(has(last.err, "continuing after"));
  CHECK_FALSE(has(last.err, "continuing after 0 steps"));
  for (const auto& entry : std::filesystem::recursive_directory_iterator(scene / "run"))
    CHECK_FALSE(sarnerf::AtomicFiles::is_temporary(entry.path()));
}

TEST_CASE("a run with patience goes on bit by bit, the best model with it") {
  const SmallScene scene(24);
  const std::vector<std::string> options{"data",  "--steps",    "150", "--holdout", "3",
                                         "--patience", "0.3", "--threads", "1",   "-q"};
  const auto with_output = [&](const char* name) { return with(options, {"-o", name}); };
  REQUIRE(scene.train(with_output("whole")).code == 0);
  REQUIRE(
      scene.train(with_output("parts"), after_lines(scene / "parts/metrics.jsonl", 5, SIGTERM)).code ==
      130);
  const Outcome resumed = scene.train({"--resume", "parts", "--threads", "1"});
  INFO(resumed.err);
  REQUIRE(resumed.code == 0);
  CHECK(read_text(scene / "parts/model.pt") == read_text(scene / "whole/model.pt"));
}
