// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/plot.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "svg_document.h"

using namespace sarnerf;

namespace {

Plot log_log() {
  Plot plot;
  plot.x = {"time (ms)", AxisScale::log, 0.1, 1000.0};
  plot.y = {"error (%)", AxisScale::log, 0.01, 100.0};
  return plot;
}

std::vector<SvgElement> drawn(const Plot& plot) { return parse_svg(svg(plot)); }

/// Where the axis' labels say that a value is.
double label_x(const std::vector<SvgElement>& all, const std::string& label) {
  for (const SvgElement& text : elements_of(all, "text", "labels")) {
    const auto anchor = text.attributes.find("text-anchor");
    if (text.text == label && anchor != text.attributes.end() && anchor->second == "middle") {
      return text.number("x");
    }
  }
  throw std::runtime_error("no label " + label);
}

std::vector<SvgElement> circles(const std::vector<SvgElement>& all) {
  auto found = elements_of(all, "path", "data");
  found.erase(std::remove_if(found.begin(), found.end(),
                             [](const SvgElement& path) {
                               return path.attributes.at("d").find('a') == std::string::npos;
                             }),
              found.end());
  return found;
}

std::string message_of(const Plot& plot) {
  try {
    svg(plot);
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("points stand over their labels, decades evenly apart") {
  Plot plot = log_log();
  plot.series = {{"", {{0.1, 0.01}, {1.0, 0.1}, {10.0, 1.0}, {100.0, 10.0}, {1000.0, 100.0}}}};
  const auto all = drawn(plot);
  const auto markers = circles(all);
  REQUIRE(markers.size() == 5);
  const Spot first = centre_of_circle(markers.front()), last = centre_of_circle(markers.back());
  const char* labels[]{"0.1", "1", "10", "100", "1000"};
  for (int n = 0; n < 5; ++n) {
    const Spot centre = centre_of_circle(markers[std::size_t(n)]);
    // Positions are written to hundredths of a pixel, a radius and a left edge among them.
    CHECK(centre.x == Approx(label_x(all, labels[n])).margin(0.02));
    CHECK(centre.x == Approx(first.x + 0.25 * n * (last.x - first.x)).margin(0.02));
    CHECK(centre.y == Approx(first.y + 0.25 * n * (last.y - first.y)).margin(0.02));
  }
  CHECK(last.y < first.y);
}

TEST_CASE("between decades positions are logarithms; on a linear axis they are proportional") {
  Plot plot = log_log();
  plot.y = {"PSNR (dB)", AxisScale::linear, 10.0, 30.0};
  plot.series = {{"", {{0.1, 10.0}, {3.0, 17.0}, {1000.0, 30.0}}}};
  const auto markers = circles(drawn(plot));
  REQUIRE(markers.size() == 3);
  const Spot low = centre_of_circle(markers[0]), middle = centre_of_circle(markers[1]),
             high = centre_of_circle(markers[2]);
  CHECK(middle.x == Approx(low.x + std::log10(30.0) / 4.0 * (high.x - low.x)).margin(0.02));
  CHECK(middle.y == Approx(low.y + 7.0 / 20.0 * (high.y - low.y)).margin(0.02));
}

TEST_CASE("open limits hold all data and bars") {
  Plot plot;
  plot.y.scale = AxisScale::log;
  plot.series = {{"", {{-3.0, 1e-7, 1e-8, 1e-6}, {5.0, 2e-7}, {5.5, 3e-2, 1e-2, 9e-2}}}};
  plot.series[0].line = PlotLine::none;
  const auto all = drawn(plot);
  CHECK(circles(all).size() == 3);
  // Bars were not cut: their heights are as the logarithms that they span.
  const auto bars = points_of(elements_of(all, "path", "data").front());
  REQUIRE(bars.size() == 12);
  const double first = bars[0].y - bars[1].y, second = bars[6].y - bars[7].y;
  CHECK(first / second == Approx(std::log(100.0) / std::log(9.0)).epsilon(1e-3));
}

TEST_CASE("one value alone, zero, and limits beyond the data still make a plot") {
  for (const AxisScale scale : {AxisScale::linear, AxisScale::log}) {
    for (const double value : {1e-80, 1e-3, 1.0, 12345.678, 1e80}) {
      Plot plot;
      plot.x.scale = plot.y.scale = scale;
      plot.series = {{"", {{value, value}}}};
      CHECK(circles(drawn(plot)).size() == 1);
      plot.x.low = 10.0 * value;
      plot.y.high = 0.1 * value;
      CHECK(circles(drawn(plot)).empty());
    }
  }
  Plot plot;
  plot.series = {{"", {{0.0, 0.0}, {0.0, -5.0}}}};
  CHECK(circles(drawn(plot)).size() == 2);
  plot.series.clear();
  CHECK_THROWS_AS(svg(plot), UsageError);
  plot.x = {"", AxisScale::linear, 0.0, 1.0};
  plot.y = {"", AxisScale::log, 0.1, 1.0};
  CHECK(circles(drawn(plot)).empty());
}

TEST_CASE("beyond the limits there are no markers, and lines end at the frame") {
  Plot plot = log_log();
  plot.series = {{"", {{0.1, 0.01}, {1e9, 1e9}, {1000.0, 100.0}, {1e-9, 1.0}}}};
  const auto all = drawn(plot);
  const auto markers = circles(all);
  REQUIRE(markers.size() == 2);
  const Spot low = centre_of_circle(markers[0]), high = centre_of_circle(markers[1]);
  const auto line = points_of(elements_of(all, "path", "data").front());
  CHECK(line.size() >= 4);
  for (const Spot& p : line) {
    CHECK((p.x >= low.x - 0.02 && p.x <= high.x + 0.02 && p.y <= low.y + 0.02 &&
           p.y >= high.y - 0.02));
  }
  // From the lower left corner to 10⁹ on both axes: 10 decades to the right and 11 up, so that y leaves first, when
  // x has grown by 4 × 10 / 11 of its 4 decades.
  CHECK(line[1].y == Approx(high.y).margin(0.02));
  CHECK(line[1].x == Approx(low.x + 10.0 / 11.0 * (high.x - low.x)).margin(0.02));
}

TEST_CASE("a bar that reaches zero ends at the frame of a logarithmic axis") {
  Plot plot = log_log();
  plot.series = {{"", {{0.1, 0.01}, {10.0, 1.0, -0.5, 2.5}}}};
  const auto all = drawn(plot);
  const auto bar = points_of(elements_of(all, "path", "data").front());
  REQUIRE(bar.size() == 6);
  CHECK(bar[0].y == Approx(centre_of_circle(circles(all)[0]).y).margin(0.02));
}

TEST_CASE("texts come through as they are, markup and all") {
  Plot plot = log_log();
  plot.title = "a<b & \"c\" 'd' ]]> </svg>";
  plot.subtitle = "<script>";
  plot.x.label = "x \x01\xFF";
  plot.series = {{"&amp;", {{1.0, 1.0}}}};
  plot.notes = {{1.0, 1.0, "<!-- note -->"}};
  const auto all = drawn(plot);
  std::set<std::string> texts;
  for (const SvgElement& text : elements_of(all, "text")) texts.insert(text.text);
  for (const char* expected : {"a<b & \"c\" 'd' ]]> </svg>", "<script>",
                               "x \xEF\xBF\xBD\xEF\xBF\xBD", "&amp;", "<!-- note -->"}) {
    CAPTURE(expected);
    CHECK(texts.count(expected) == 1);
  }
  CHECK(all.front().attributes.at("aria-label") == plot.title);
}

TEST_CASE("the same plot gives the same bytes, on a background of its own") {
  Plot plot = log_log();
  plot.series = {{"a", {{1.0, 1.0}, {2.0, 0.5}}}, {"b", {{1.0, 2.0}}}};
  CHECK(svg(plot) == svg(plot));
  const auto background = elements_of(drawn(plot), "rect").front();
  CHECK(background.attributes.at("fill") == "#ffffff");
  CHECK(background.number("width") == 800.0);
  CHECK(background.number("height") == 540.0);
}

TEST_CASE("56 series differ in colour or shape") {
  Plot plot = log_log();
  for (int s = 0; s < 56; ++s) plot.series.push_back({"", {{10.0, 1.0}}});
  std::set<std::string> looks;
  for (const SvgElement& path : elements_of(drawn(plot), "path", "data")) {
    looks.insert(path.attributes.at("d") + path.attributes.at("fill"));
  }
  CHECK(looks.size() == 56);
}

TEST_CASE("a front through points of other series hides none of them") {
  Plot plot = log_log();
  plot.series = {{"front", {{1.0, 1.0}, {10.0, 0.1}}}, {"a", {{1.0, 1.0}, {10.0, 0.1}}}};
  plot.series[0].marker = PlotMarker::ring;
  plot.series[0].emphasised = true;
  const auto paths = elements_of(drawn(plot), "path", "data");
  REQUIRE(paths.size() == 6);  // two lines, two discs, two rings, in this order
  CHECK(paths[4].attributes.at("fill") == "none");
  CHECK(paths[5].attributes.at("fill") == "none");
  CHECK(centre_of_circle(paths[2]).x == Approx(centre_of_circle(paths[4]).x).margin(0.02));
}

TEST_CASE("curves of many points have no markers unless asked for") {
  Plot plot = log_log();
  plot.series = {{"curve", {}}};
  for (int n = 0; n < 200; ++n) plot.series[0].points.push_back({1.0 + n, 1.0});
  CHECK(circles(drawn(plot)).empty());
  plot.series[0].marker = PlotMarker::circle;
  CHECK(circles(drawn(plot)).size() == 200);
}

TEST_CASE("values without a place are refused by name") {
  const auto with = [](const std::function<void(Plot&)>& change) {
    Plot plot = log_log();
    plot.series = {{"first", {{1.0, 1.0}}}, {"surface engine", {{1.0, 1.0}, {2.0, 2.0}}}};
    change(plot);
    return message_of(plot);
  };
  CHECK(with([](Plot&) {}).empty());
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY), 1e200, 1e-200}) {
    const std::string message = with([&](Plot& plot) { plot.series[1].points[1].y = bad; });
    CAPTURE(bad, message);
    CHECK(message.find("series[1] 'surface engine', point 1: y: expected") != std::string::npos);
    CHECK(message.find('\n') == std::string::npos);
    CHECK_FALSE(with([&](Plot& plot) { plot.series[0].points[0].x = bad; }).empty());
    CHECK_FALSE(with([&](Plot& plot) { plot.series[0].points[0].y_high = bad; }).empty());
    CHECK_FALSE(with([&](Plot& plot) { plot.x.low = bad; }).empty());
    CHECK_FALSE(with([&](Plot& plot) { plot.notes = {{1.0, bad, "note"}}; }).empty());
  }
  CHECK_FALSE(with([](Plot& plot) { plot.series[0].points[0].y_low = NAN; }).empty());
  CHECK_FALSE(with([](Plot& plot) { plot.x.high = 0.05; }).empty());
  CHECK_FALSE(with([](Plot& plot) { plot.x.high = plot.x.low; }).empty());
  CHECK_FALSE(with([](Plot& plot) { plot.x.high = *plot.x.low * (1.0 + 1e-9); }).empty());
  for (const double bad : {0.0, 100.0, 1e9, double(NAN), double(INFINITY)}) {
    CHECK_FALSE(with([&](Plot& plot) { plot.width_px = bad; }).empty());
    CHECK_FALSE(with([&](Plot& plot) { plot.height_px = bad; }).empty());
  }
  for (const double bad : {0.0, 11.9, 100.0, double(NAN), double(INFINITY)}) {
    CHECK_FALSE(with([&](Plot& plot) { plot.text_px = bad; }).empty());
  }
}
