// SPDX-License-Identifier: Apache-2.0
// What is read off a study's scores.
#include <cmath>

#include "catch.h"
#include "learning.h"

using namespace sarnerf;
using namespace sarnerf::bench;

namespace {

LearningRun run_of(const std::string& field, double planned_s, std::uint64_t seed,
                   const std::vector<std::pair<double, double>>& scores) {
  LearningRun run;
  run.field = field;
  run.planned_s = planned_s;
  run.seed = seed;
  std::int64_t step = 0;
  for (const auto& [seconds, psnr_db] : scores) run.points.push_back({seconds, 2.0 * seconds, ++step, psnr_db});
  return run;
}

/// Two seeds of `grid`, each planned for 4 and for 16 s, and one run of `paper`.
LearningStudy small_study() {
  LearningStudy study;
  study.n_training_views = 36;
  study.views = {"a", "b"};
  study.baselines = {{"nearest", 20.0}, {"linear", 33.0}, {"turned", 31.0}};
  study.runs = {run_of("grid", 4.0, 1, {{1.0, 20.0}, {4.0, 40.0}}),
                run_of("grid", 4.0, 2, {{2.0, 25.0}, {4.0, 36.0}}),
                run_of("grid", 16.0, 1, {{1.0, 20.0}, {16.0, 46.0}}),
                run_of("grid", 16.0, 2, {{16.0, 44.0}}),
                run_of("paper", 100.0, 1, {{50.0, 12.0}, {100.0, 30.0}})};
  return study;
}

}  // namespace

TEST_CASE("seconds to a PSNR are linear in the logarithm of time between scores") {
  const LearningRun run = run_of("grid", 16.0, 1, {{1.0, 20.0}, {4.0, 40.0}, {16.0, 39.0}});
  CHECK(seconds_to(run, 30.0).value() == Approx(2.0));
  CHECK(seconds_to(run, 40.0).value() == Approx(4.0));
  CHECK(seconds_to(run, 19.0).value() == Approx(1.0));
  CHECK_FALSE(seconds_to(run, 40.1));
  CHECK_FALSE(seconds_to(LearningRun{}, 1.0));
}

TEST_CASE("a field's seconds are the median over seeds of its earliest run") {
  const LearningStudy study = small_study();
  // Seed 1 gets there between 1 and 4 s, seed 2 between 2 and 4 s.
  const double first_s = 2.0, second_s = 2.0 * std::pow(2.0, 5.0 / 11.0);
  CHECK(seconds_to(study, "grid", 30.0).value() == Approx(0.5 * (first_s + second_s)));
  // One of two seeds never has 45 dB: no median.
  CHECK_FALSE(seconds_to(study, "grid", 45.0));
  CHECK_FALSE(seconds_to(study, "mlp", 10.0));
}

TEST_CASE("the diagram joins ends of runs and has the best baseline") {
  const Plot plot = learning_diagram(small_study());
  REQUIRE(plot.series.size() == 4);
  const PlotSeries& ends = plot.series[0];
  REQUIRE(ends.points.size() == 2);
  CHECK(ends.points[0].x == Approx(4.0));
  CHECK(ends.points[0].y == Approx(38.0));
  CHECK(ends.points[0].y_low.value() == Approx(36.0));
  CHECK(ends.points[0].y_high.value() == Approx(40.0));
  CHECK(ends.points[1].y == Approx(45.0));
  CHECK(plot.series[1].points.back().y == Approx(46.0));
  CHECK(plot.series[2].points.size() == 2);
  for (const PlotPoint& p : plot.series[3].points) CHECK(p.y == Approx(33.0));
  CHECK(plot.series[3].points.front().x == Approx(1.0));
  CHECK(plot.series[3].points.back().x == Approx(100.0));
  CHECK(has(svg(plot), "linear"));
}

TEST_CASE("the tables tell of runs that diverged and of equal quality") {
  LearningStudy study = small_study();
  study.runs.push_back(run_of("mlp", 9.0, 1, {}));
  study.runs.back().diverged = "the loss is not finite";
  const std::string text = learning_tables(study);
  CHECK(has(text, "30.00 dB, paper's best"));
  CHECK(has(text, "38.00 (36.00 to 40.00)"));
  CHECK(has(text, "diverged"));
  CHECK(has(text, "Best baseline: linear, 33.00 dB."));
  CHECK_FALSE(has(svg(learning_diagram(study)), "mlp"));
}
