// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>

#include "catch.h"
#include "sarnerf/report/plot.h"
#include "svg_document.h"

using namespace sarnerf;

namespace {

/// Errors that fall with time, as of several methods.
Plot work_precision(int n_series, int n_points, unsigned seed) {
  Plot plot;
  plot.title = "Error against run time";
  plot.subtitle = "house, 512 × 512 pixels, incidence 45°, two threads";
  plot.x = {"time per image (ms)", AxisScale::log};
  plot.y = {"error E (%)", AxisScale::log};
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.2);
  for (int s = 0; s < n_series; ++s) {
    PlotSeries series{"method " + std::to_string(s), {}};
    series.line = s % 2 ? PlotLine::solid : PlotLine::none;
    for (int p = 0; p < n_points; ++p) {
      const double t = 0.2 * std::pow(1500.0, p / double(n_points));
      series.points.push_back(
          {t * std::exp(0.2 * noise(random)),
           20.0 * std::pow(t / 0.2, -0.5 - 0.4 * s / n_series) * std::exp(noise(random))});
    }
    plot.series.push_back(series);
  }
  return plot;
}

/// All texts apart from each other and within the picture, as cairo measures them.
void check_texts(const Plot& plot) {
  const auto all = parse_svg(svg(plot));
  const Rect picture{0.0, 0.0, all.front().number("width"), all.front().number("height")};
  const auto texts = elements_of(all, "text");
  std::vector<Rect> boxes;
  for (const SvgElement& text : texts) {
    boxes.push_back(drawn_bounds(text));
    CAPTURE(text.text);
    CHECK(picture.holds(boxes.back()));
    CHECK(text.number("font-size") >= 12.0);
    for (std::size_t n = 0; n + 1 < boxes.size(); ++n) {
      if (!overlap(boxes[n], boxes.back())) continue;
      CAPTURE(texts[n].text);
      CHECK_FALSE(overlap(boxes[n], boxes.back()));
    }
  }
}

/// A legend inside the plot covers neither points nor corners of lines.
bool check_legend(const Plot& plot) {
  const auto all = parse_svg(svg(plot));
  const auto boxes = elements_of(all, "rect", "legend");
  if (boxes.empty()) return false;
  const Rect box{boxes[0].number("x"), boxes[0].number("y"),
                 boxes[0].number("x") + boxes[0].number("width"),
                 boxes[0].number("y") + boxes[0].number("height")};
  for (const SvgElement& path : elements_of(all, "path", "data")) {
    for (const Spot& spot : points_of(path)) CHECK_FALSE(box.holds(spot));
  }
  for (const SvgElement& text : elements_of(all, "text", "legend")) {
    CHECK(box.holds(drawn_bounds(text)));
  }
  return true;
}

}  // namespace

TEST_CASE("a usual diagram has its legend inside, at both sizes") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Plot plot = work_precision(4, 20, seed);
    plot.notes = {{plot.series[0].points[3].x, plot.series[0].points[3].y, "default"},
                  {plot.series[1].points[12].x, plot.series[1].points[12].y, "--error 0.01"}};
    check_texts(plot);
    CHECK(check_legend(plot));
    plot.width_px = 600.0;
    plot.height_px = 400.0;
    plot.text_px = 12.0;
    check_texts(plot);
    check_legend(plot);
  }
}

TEST_CASE("notes keep clear of markers where there is room") {
  Plot plot = work_precision(2, 10, 1);
  for (const std::size_t p : {0u, 4u, 9u}) {
    plot.notes.push_back(
        {plot.series[0].points[p].x, plot.series[0].points[p].y, "setting " + std::to_string(p)});
  }
  check_texts(plot);
  const auto all = parse_svg(svg(plot));
  const auto notes = elements_of(all, "text", "notes");
  REQUIRE(notes.size() == 3);
  for (const SvgElement& note : notes) {
    for (const SvgElement& path : elements_of(all, "path", "data")) {
      if (path.attributes.at("fill") == "none") continue;
      for (const Spot& spot : points_of(path)) CHECK_FALSE(drawn_bounds(note).holds(spot));
    }
  }
}

TEST_CASE("a note amidst a crowd of markers moves out of it") {
  Plot plot;
  plot.x = {"", AxisScale::linear, 0.0, 100.0};
  plot.y = {"", AxisScale::linear, 0.0, 100.0};
  plot.series = {{"", {}}};
  plot.series[0].line = PlotLine::none;
  plot.series[0].marker = PlotMarker::square;
  // Rows nearer to each other than a line of text is high.
  for (int column = -4; column <= 4; ++column) {
    for (int row = -4; row <= 4; ++row)
      plot.series[0].points.push_back({50.0 + 2.5 * column, 50.0 + 3.5 * row});
  }
  plot.notes = {{50.0, 50.0, "in the middle"}};
  const auto all = parse_svg(svg(plot));
  const auto notes = elements_of(all, "text", "notes");
  REQUIRE(notes.size() == 1);
  for (const SvgElement& path : elements_of(all, "path", "data")) {
    for (const Spot& spot : points_of(path)) CHECK_FALSE(drawn_bounds(notes[0]).holds(spot));
  }
  CHECK(elements_of(all, "path", "notes").size() == 1);  // the line that leads to the point
}

TEST_CASE("wide labels at the ends of an axis stay within the picture") {
  Plot plot;
  plot.width_px = 400.0;
  plot.height_px = 300.0;
  plot.x = {"", AxisScale::linear, 1.2345e-7, 1.2346e-7};
  plot.y = {"", AxisScale::linear, 0.0, 8.0};
  check_texts(plot);
  plot.x = {"", AxisScale::log, 1e-10, 1e90};
  check_texts(plot);
}

TEST_CASE("a legend that finds no free corner stands beside the plot, a long one below") {
  Plot plot = work_precision(4, 20, 1);
  for (const double x : {0.2, 300.0}) {
    for (const double y : {0.03, 20.0}) plot.series[0].points.push_back({x, y});
  }
  check_texts(plot);
  CHECK_FALSE(check_legend(plot));
  auto all = parse_svg(svg(plot));
  CHECK(all.front().number("height") == plot.height_px);
  CHECK(elements_of(all, "text", "legend").size() == 4);

  for (int s = 4; s < 40; ++s)
    plot.series.push_back({"method " + std::to_string(s), plot.series[1].points});
  check_texts(plot);
  all = parse_svg(svg(plot));
  CHECK(all.front().number("height") > plot.height_px);
  const auto legend = elements_of(all, "text", "legend"),
             labels = elements_of(all, "text", "labels");
  CHECK(legend.size() == 40);
  double lowest_label = 0.0;
  for (const SvgElement& text : labels)
    lowest_label = std::max(lowest_label, drawn_bounds(text).y1);
  for (const SvgElement& text : legend) CHECK(drawn_bounds(text).y0 > lowest_label);
}

TEST_CASE("a legend that may not stand beside the plot stands below and leaves it its width") {
  Plot plot = work_precision(4, 20, 1);
  for (const double x : {0.2, 300.0}) {
    for (const double y : {0.03, 20.0}) plot.series[0].points.push_back({x, y});
  }
  const auto data_width = [&] {
    double left = 1e9, right = 0.0;
    for (const SvgElement& path : elements_of(parse_svg(svg(plot)), "path", "data")) {
      for (const Spot& p : points_of(path)) {
        left = std::min(left, p.x);
        right = std::max(right, p.x);
      }
    }
    return right - left;
  };
  const double beside = data_width();
  plot.legend_beside = false;
  check_texts(plot);
  CHECK(data_width() > 1.15 * beside);
  const auto all = parse_svg(svg(plot));
  double lowest_label = 0.0;
  for (const SvgElement& text : elements_of(all, "text", "labels"))
    lowest_label = std::max(lowest_label, drawn_bounds(text).y1);
  const auto legend = elements_of(all, "text", "legend");
  CHECK(legend.size() == 4);
  for (const SvgElement& text : legend) CHECK(drawn_bounds(text).y0 > lowest_label);
}

TEST_CASE("long names break, and texts still keep apart") {
  for (const std::string& word :
       {std::string(400, 'W'), std::string(400, 'i'), std::string("élévation_Щ")}) {
    Plot plot = work_precision(9, 12, 3);
    std::string sentence;
    for (int n = 0; n < 12; ++n) sentence += word.substr(0, 40) + ' ';
    for (PlotSeries& series : plot.series) series.name += ' ' + sentence;
    plot.series[4].name = word;
    plot.title = plot.subtitle = plot.x.label = plot.y.label = sentence + word;
    plot.notes = {{1.0, 1.0, sentence}, {2.0, 0.5, word}};
    check_texts(plot);
    plot.width_px = 384.0;
    plot.height_px = 256.0;
    check_texts(plot);
  }
}

TEST_CASE("notes without room are counted") {
  Plot plot = work_precision(3, 20, 4);
  for (int n = 0; n < 200; ++n) {
    const PlotPoint& point = plot.series[0].points[std::size_t(n % 20)];
    plot.notes.push_back({point.x, point.y, "note number " + std::to_string(n)});
  }
  check_texts(plot);
  const auto all = parse_svg(svg(plot));
  const auto placed = elements_of(all, "text", "notes").size();
  CHECK(placed > 10);
  CHECK(placed < 200);
  const auto labels = elements_of(all, "text", "labels");
  CHECK(std::any_of(labels.begin(), labels.end(), [&](const SvgElement& text) {
    return text.text == std::to_string(200 - placed) + " notes left out for want of room";
  }));
}

TEST_CASE("whatever the ranges and sizes, texts keep apart and within the picture") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0), exponent(-12.0, 12.0);
  for (int n = 0; n < 150; ++n) {
    Plot plot;
    plot.text_px = 12.0 + 8.0 * unit(random);
    plot.width_px = plot.text_px * (24.0 + 40.0 * unit(random));
    plot.height_px = plot.text_px * (16.0 + 30.0 * unit(random));
    if (n % 2) plot.title = "Title " + std::string(std::size_t(60.0 * unit(random)), 'm');
    if (n % 3) plot.x.label = "label of x";
    if (n % 5) plot.y.label = "label of y";
    plot.x.scale = n % 4 < 2 ? AxisScale::log : AxisScale::linear;
    plot.y.scale = n % 8 < 4 ? AxisScale::log : AxisScale::linear;
    const double x0 = std::pow(10.0, exponent(random)), y0 = std::pow(10.0, exponent(random));
    const double x_span = std::pow(10.0, 0.5 * exponent(random)),
                 y_span = std::pow(10.0, 0.5 * exponent(random));
    const int n_series = 1 + int(12.0 * unit(random));
    for (int s = 0; s < n_series; ++s) {
      PlotSeries series{
          unit(random) < 0.2 ? "" : std::string(std::size_t(1 + 30.0 * unit(random)), 'n'), {}};
      for (int p = 0; p < 15; ++p) {
        series.points.push_back(
            {x0 * (1.0 + x_span * unit(random)), y0 * (1.0 + y_span * unit(random))});
      }
      if (plot.y.scale == AxisScale::linear) series.points[0].y *= -1.0;
      const PlotPoint& at = series.points[7];
      if (n % 3 == 0) plot.notes.push_back({at.x, at.y, "note of series " + std::to_string(s)});
      plot.series.push_back(std::move(series));
    }
    CAPTURE(n);
    check_texts(plot);
    check_legend(plot);
  }
}
