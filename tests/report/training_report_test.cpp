// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/training_report.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.h"
#include "example_report.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

namespace {

constexpr double kInfinite_dB = std::numeric_limits<double>::infinity();

template <class Block>
std::vector<Block> blocks_of(const Page& page) {
  std::vector<Block> found;
  for (const PageBlock& block : page.blocks) {
    if (const auto* it = std::get_if<Block>(&block)) found.push_back(*it);
  }
  return found;
}

std::vector<std::string> headings_of(const TrainingReport& report) {
  std::vector<std::string> names;
  for (const PageHeading& heading : blocks_of<PageHeading>(training_report(report)))
    names.push_back(heading.text);
  return names;
}

/// All notes and warnings, a line each.
std::string notices_of(const TrainingReport& report) {
  std::string all;
  for (const PageNotice& notice : blocks_of<PageNotice>(training_report(report)))
    all += notice.text + '\n';
  return all;
}

bool holds(const std::string& text, const std::string& piece) {
  return text.find(piece) != std::string::npos;
}

const PlotSeries& series_of(const Plot& plot, const std::string& name) {
  const auto found = std::find_if(plot.series.begin(), plot.series.end(),
                                  [&](const PlotSeries& series) { return series.name == name; });
  if (found == plot.series.end()) throw std::runtime_error("no series " + name);
  return *found;
}

}  // namespace

TEST_CASE("the example has all sections, and an empty report says what is missing") {
  CHECK(headings_of(example_report()) ==
        std::vector<std::string>{"What was trained", "Accuracy on held-out views", "View by view",
                                 "Truth, prediction, difference", "Where the time went",
                                 "What was left out", "Configuration", "Machine and version"});
  CHECK(headings_of({}) == std::vector<std::string>{"Accuracy on held-out views"});
  CHECK(holds(notices_of({}), "No views were held out"));
  CHECK_FALSE(holds(notices_of(example_report()), "held out"));
}

TEST_CASE("a section without content is absent, and the others stay") {
  const auto without = [](auto part) {
    TrainingReport report = example_report();
    report.*part = {};
    return headings_of(report);
  };
  const auto lacks = [](const std::vector<std::string>& headings, const char* name) {
    return headings.size() == 7 &&
           std::find(headings.begin(), headings.end(), name) == headings.end();
  };
  CHECK(lacks(without(&TrainingReport::trained), "What was trained"));
  CHECK(lacks(without(&TrainingReport::pictures), "Truth, prediction, difference"));
  CHECK(lacks(without(&TrainingReport::stages), "Where the time went"));
  CHECK(lacks(without(&TrainingReport::left_out), "What was left out"));
  CHECK(lacks(without(&TrainingReport::configuration), "Configuration"));
  CHECK(lacks(without(&TrainingReport::machine), "Machine and version"));
  CHECK(without(&TrainingReport::curves).size() == 8);
  CHECK(without(&TrainingReport::warnings).size() == 8);
}

TEST_CASE("what was not scored is said") {
  TrainingReport report = example_report();
  report.baselines.clear();
  CHECK(holds(notices_of(report), "No baselines were scored"));
  report.model.reset();
  CHECK(holds(notices_of(report), "The 24 held-out views were not scored."));
}

TEST_CASE(
    "at a glance: the mean, the margin over the best baseline, the time, and what was given") {
  const auto figures = blocks_of<PageFigures>(training_report(example_report())).at(0).figures;
  REQUIRE(figures.size() == 5);
  CHECK(figures[0].value == "48.2 dB");
  CHECK(figures[1].value == "+8.3 dB");
  CHECK(holds(figures[1].meaning, "rotate, then linear"));
  CHECK(figures[3].value == "13.1 s");
  CHECK(figures[4].value == "0.42 ms");
  TrainingReport worse = example_report();
  worse.model->mean.psnr_power_db = 38.0;
  CHECK(blocks_of<PageFigures>(training_report(worse)).at(0).figures[1].value == "−1.9 dB");
}

TEST_CASE("a model that interpolation beats is warned of, one beyond it is not") {
  TrainingReport report = example_report();
  CHECK_FALSE(holds(notices_of(report), "no better than"));
  for (const double psnr_db : {39.9, 30.0, -kInfinite_dB}) {
    report.model->mean.psnr_power_db = psnr_db;
    CHECK(holds(notices_of(report), "no better than “rotate, then linear”"));
  }
  report.model->mean.psnr_power_db = kInfinite_dB;
  CHECK_FALSE(holds(notices_of(report), "no better than"));
  report.baselines[0].mean.psnr_power_db = kInfinite_dB;
  CHECK(holds(notices_of(report), "no better than “nearest view”"));
}

TEST_CASE(
    "the table of scores has a row for each method, ours first, and says why LPIPS is missing") {
  TrainingReport report = example_report();
  PageTable table = blocks_of<PageTable>(training_report(report)).at(0);
  REQUIRE(table.rows.size() == 4);
  REQUIRE(table.columns.size() == 5);
  CHECK(table.rows[0] == std::vector<std::string>{"grid", "48.20", "39.20", "42.20", "0.9910"});
  CHECK(table.emphasised == std::vector<std::size_t>{0});
  CHECK(holds(table.caption, "LPIPS was not computed: no weights were given."));
  CHECK(holds(table.caption, "peak 1.25"));

  report.model->mean.lpips = 0.0123;
  report.baselines[1].mean.psnr_power_db = kInfinite_dB;
  table = blocks_of<PageTable>(training_report(report)).at(0);
  CHECK(table.columns.back().heading == "LPIPS");
  CHECK(table.rows[0].back() == "0.0123");
  CHECK(table.rows[1].back() == "–");
  CHECK(table.rows[2][1] == "∞");
  CHECK_FALSE(holds(table.caption, "not computed"));
}

TEST_CASE("every held-out view has its row beside the best baseline's, folded") {
  const TrainingReport report = example_report();
  const PageTable table = blocks_of<PageTable>(training_report(report)).at(1);
  CHECK(table.folded);
  REQUIRE(table.rows.size() == 24);
  CHECK(table.columns.back().heading == "rotate, then linear: PSNR, power (dB)");
  CHECK(table.rows[2][0] == "test_2.tif");
  CHECK(table.rows[2][1] == "35.00");
  CHECK(std::stod(table.rows[2].back()) ==
        Approx(*report.baselines[2].per_view[2].psnr_power_db).margin(0.005));
}

TEST_CASE(
    "the curve is drawn as it is, the baselines across its whole width in their own colours") {
  TrainingReport report = example_report();
  report.curves[0].points.push_back({1e3, kInfinite_dB});
  report.curves.push_back({"mlp", {{5.0, 20.0}, {100.0, 41.0}}, false});
  const Plot plot = blocks_of<PagePlot>(training_report(report)).at(0).plot;
  const PlotSeries& curve = series_of(plot, "grid");
  REQUIRE(curve.points.size() == 30);
  CHECK(curve.points[7].x == report.curves[0].points[7].seconds);
  CHECK(curve.points[7].y == report.curves[0].points[7].psnr_db);
  CHECK(curve.emphasised);
  CHECK(plot.x.scale == AxisScale::log);
  const PlotSeries& level = series_of(plot, "rotate, then linear");
  REQUIRE(level.points.size() == 2);
  CHECK(level.points[0].x == 0.4);
  CHECK(level.points[1].x == 100.0);
  CHECK((level.points[0].y == 39.9 && level.points[1].y == 39.9));
  const Plot over_azimuth = blocks_of<PagePlot>(training_report(report)).at(1).plot;
  CHECK(level.colour == series_of(over_azimuth, "rotate, then linear").colour);
  CHECK(level.colour != series_of(plot, "mlp").colour);

  report.curves = {{"short", {{0.0, 20.0}, {3.0, 30.0}}}};
  CHECK(blocks_of<PagePlot>(training_report(report)).at(0).plot.x.scale == AxisScale::linear);
}

TEST_CASE("views of one azimuth and several incidences: means, bars, and a plot over incidence") {
  TrainingReport report;
  report.model = ReportMethod{"grid", {}, {}};
  for (const double azimuth_deg : {20.0, 10.0}) {
    for (const double incidence_deg : {40.0, 50.0, 60.0}) {
      report.held_out.push_back({"", azimuth_deg, incidence_deg});
      report.model->per_view.push_back({azimuth_deg + incidence_deg, {}, {}, {}, {}});
    }
  }
  auto plots = blocks_of<PagePlot>(training_report(report));
  REQUIRE(plots.size() == 2);
  const auto azimuths = series_of(plots[0].plot, "grid").points,
             incidences = series_of(plots[1].plot, "grid").points;
  REQUIRE((azimuths.size() == 2 && incidences.size() == 3));
  CHECK((azimuths[0].x == 10.0 && azimuths[0].y == Approx(60.0) && azimuths[0].y_low == 50.0 &&
         azimuths[0].y_high == 70.0));
  CHECK((incidences[2].x == 60.0 && incidences[2].y == Approx(75.0) &&
         incidences[2].y_low == 70.0 && incidences[2].y_high == 80.0));

  // Infinite and missing scores are told and left out.
  report.model->per_view[0].psnr_power_db = kInfinite_dB;
  report.model->per_view[1].psnr_power_db = {};
  plots = blocks_of<PagePlot>(training_report(report));
  CHECK(holds(plots[0].caption, "1 view of infinite PSNR"));
  CHECK(series_of(plots[0].plot, "grid").points[1].y == 80.0);
  CHECK_FALSE(training_report_html(report).empty());
}

TEST_CASE("one view alone has scores but no plot over its angle") {
  TrainingReport report = example_report();
  report.held_out.resize(1);
  report.model->per_view.resize(1);
  for (ReportMethod& baseline : report.baselines) baseline.per_view.resize(1);
  CHECK(blocks_of<PagePlot>(training_report(report)).size() == 1);
}

TEST_CASE("pictures: one scale in decibels for all, differences signed and relative to the peak") {
  TrainingReport report;
  report.peak_power = 10.0;
  ReportPictures pictures;
  pictures.view = {"a.tif", 12.5, 45.0};
  pictures.truth = Image<float>(1, 4, 1.0f);
  pictures.prediction = Image<float>(1, 4, 1.0f);
  pictures.truth(0, 1) = 1e-2f;  // 20 dB below white: half the range
  pictures.truth(0, 2) = pictures.prediction(0, 2) = 0.0f;
  pictures.prediction(0, 1) = 0.21f;  // 2 % of the peak too bright
  pictures.prediction(0, 3) = 0.9f;   // 1 % too dark
  report.pictures = {pictures, pictures};
  const Page page = training_report(report);
  const auto rows = blocks_of<PagePictures>(page);
  REQUIRE(rows.size() == 2);
  CHECK(holds(rows[0].caption, "azimuth 12.5°, incidence 45°"));
  const auto& truth = std::get<Image<std::uint8_t>>(rows[0].pictures[0].pixels);
  CHECK(truth(0, 0) == 255);
  CHECK(int(truth(0, 1)) == Approx(127.5).margin(1.0));
  CHECK(truth(0, 2) == 0);
  const auto& difference = std::get<Image<Colour>>(rows[0].pictures[2].pixels);
  CHECK(difference(0, 0) == Colour{245, 245, 245});
  CHECK(difference(0, 1)[0] > difference(0, 1)[2]);
  CHECK(difference(0, 3)[0] < difference(0, 3)[2]);
  const auto scales = blocks_of<PageScales>(page).at(0).scales;
  CHECK(scales[0].labels == std::vector<std::string>{"≤ −40.0", "−20.0", "≥ 0.0"});
  CHECK(scales[1].labels == std::vector<std::string>{"≤ −2", "0", "≥ +2"});
}

TEST_CASE("pictures of nothing, of equal images and without a peak are shown") {
  TrainingReport report;
  report.pictures = {{{}, {}, Image<float>(2, 2), Image<float>(2, 2), false}};
  CHECK_FALSE(training_report_html(report).empty());
  const Page page = training_report(report);
  CHECK(blocks_of<PageScales>(page).at(0).scales[0].labels ==
        std::vector<std::string>{"nothing above zero"});
  CHECK(holds(blocks_of<PagePictures>(page).at(0).caption, "Training view"));
  report.pictures[0].prediction(0, 0) = NAN;
  CHECK_FALSE(training_report_html(report).empty());
}

TEST_CASE("the same report gives the same bytes") {
  CHECK(training_report_html(example_report()) == training_report_html(example_report()));
}

TEST_CASE("images and scores that do not belong together are refused by name") {
  TrainingReport report = example_report();
  report.pictures[1].prediction = Image<float>(3, 4);
  CHECK_THROWS_WITH(training_report(report),
                    "report: view 'test_12.tif': expected a prediction of the truth's size, 64 × "
                    "48, found 3 × 4");
  report = example_report();
  report.baselines[1].per_view.pop_back();
  CHECK_THROWS_WITH(
      training_report(report),
      "report: 'linear between views': expected scores of 24 held-out views, found 23");
}
