// SPDX-License-Identifier: Apache-2.0
#include "browser.h"

#include <opencv2/imgcodecs.hpp>

#include "catch.h"
#include "example_report.h"
#include "page_audit.h"
#include "sarnerf/report/page.h"
#include "svg_document.h"

using namespace sarnerf;

namespace {

/// One browser for all tests: it takes a second to start.
Browser& browser() {
  static Browser instance(SARNERF_CHROMIUM);
  return instance;
}

template <class T>
T value_of(const std::string& expression) {
  return browser().evaluate(expression).get<T>();
}

std::vector<std::string> audit() { return value_of<std::vector<std::string>>(kPageAudit); }

void show(const std::string& html, int width_px, bool dark) {
  static const ScratchFolder folder;
  write_text(folder / "page.html", html);
  browser().show_as(width_px, 800, dark);
  browser().open(folder / "page.html");
}

const std::vector<std::string> kNothing;

/// A word, a table and a name that fit no narrow window, an image of one pixel, one high and one wide one.
Page awkward_page() {
  Page page;
  page.title = "A_title_of_one_word_" + std::string(200, 'x');
  page.subtitle = std::string(300, 'y');
  PageTable wide{"A table of many columns", {{"row"}}, {{"first"}}, {}, false};
  for (int c = 0; c < 30; ++c) {
    wide.columns.push_back({"column " + std::to_string(c), Align::right});
    wide.rows[0].push_back("1234567890");
  }
  page.blocks = {PageHeading{"Heading " + std::string(100, 'z')},
                 PageHeading{"Another"},
                 PageParagraph{std::string(500, 'w')},
                 PageNotice{std::string(500, 'v'), PageNotice::Kind::warning},
                 PageFigures{{{std::string(60, '8'), std::string(90, 'm')}}},
                 PageFacts{"", {{std::string(80, 'n'), std::string(400, 'p')}}},
                 wide,
                 PagePictures{{{Image<std::uint8_t>(1, 1, 200), "one pixel", "one pixel"},
                               {Image<std::uint8_t>(1, 3000, 200), "wide", "wide"},
                               {Image<std::uint8_t>(3000, 1, 200), std::string(80, 'q'), "high"}},
                              std::string(200, 'c')}};
  return page;
}

}  // namespace

TEST_CASE(
    "the report can be read in wide and narrow windows, light and dark, and asks for nothing") {
  const std::string html = training_report_html(example_report());
  const std::size_t n_elements = parse_svg(html.substr(html.find('\n') + 1)).size();
  for (const int width_px : {1280, 800, 641, 640, 400, 320}) {
    for (const bool dark : {false, true}) {
      CAPTURE(width_px, dark);
      show(html, width_px, dark);
      CHECK(value_of<int>("window.innerWidth") == width_px);
      CHECK(audit() == kNothing);
      browser().evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })");
      CHECK(audit() == kNothing);
      CHECK(browser().complaints() == kNothing);
      CHECK(browser().requests() == kNothing);
      // HTML's rules have neither moved nor added an element: the page is nested as HTML allows.
      CHECK(value_of<std::size_t>("document.querySelectorAll('*').length") == n_elements);
      CHECK(value_of<std::string>("document.compatMode") == "CSS1Compat");
      CHECK(value_of<int>("document.images.length") == 8);
      // Of each plot's two drawings one is shown.
      CHECK(value_of<int>("[...document.querySelectorAll('.plot svg')]"
                          ".filter((s) => s.checkVisibility()).length") == 2);
    }
  }
}

TEST_CASE("a table wider than the window scrolls in its own box") {
  show(page_html(awkward_page()), 400, false);
  CHECK(audit() == kNothing);
  CHECK(
      value_of<bool>("(() => { const box = document.querySelector('.scroll');"
                     "return box.scrollWidth > box.clientWidth + 1000; })()"));
  show(page_html(awkward_page()), 1280, true);
  CHECK(audit() == kNothing);
}

TEST_CASE("a report of nothing is a page, too") {
  show(training_report_html({}), 400, false);
  CHECK(audit() == kNothing);
  CHECK(browser().complaints() == kNothing);
}

TEST_CASE("the list of contents leads to its sections") {
  show(training_report_html(example_report()), 1280, false);
  CHECK(value_of<bool>(
      "[...document.querySelectorAll('nav a')].every((a) =>"
      "document.querySelector(a.hash).textContent.trim() === a.textContent.trim())"));
  CHECK(value_of<int>("document.querySelectorAll('nav a').length") ==
        value_of<int>("document.querySelectorAll('h2').length"));
}

TEST_CASE("a picture is shown with its pixels: rows downwards, columns to the right") {
  Image<Colour> quarters(2, 2);
  quarters(0, 0) = {255, 0, 0};
  quarters(0, 1) = {0, 255, 0};
  quarters(1, 0) = {0, 0, 255};
  quarters(1, 1) = {200, 100, 50};
  Page page;
  page.blocks = {PagePictures{{{quarters, "quarters", "four colours"}}, ""}};
  show(page_html(page), 400, false);
  const auto box = value_of<std::vector<double>>(
      "(() => { const b = document.images[0].getBoundingClientRect(); return [b.x, b.y, b.width, "
      "b.height]; })()");
  const std::string png = browser().screenshot();
  const cv::Mat shot = cv::imdecode(
      cv::Mat(1, int(png.size()), CV_8UC1, const_cast<char*>(png.data())), cv::IMREAD_COLOR);
  REQUIRE(shot.cols == 400);
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      const int x = int(box[0] + (0.25 + 0.5 * column) * box[2]);
      const int y = int(box[1] + (0.25 + 0.5 * row) * box[3]);
      REQUIRE((x < shot.cols && y < shot.rows));
      const Colour& c = quarters(row, column);
      CHECK(shot.at<cv::Vec3b>(y, x) == cv::Vec3b(c[2], c[1], c[0]));
    }
  }
}

TEST_CASE("markup in texts stays text") {
  const std::string attack =
      "<script>document.title = 'changed'</script><img src=\"x\" onerror=\"alert(1)\">";
  TrainingReport report = example_report();
  report.title = report.summary = report.model->name = report.lpips_missing = attack;
  report.held_out[0].name = report.stages[0].name = report.curves[0].name = attack;
  report.configuration[0] = {attack, attack};
  show(training_report_html(report), 1280, false);
  CHECK(value_of<std::string>("document.title") == attack);
  CHECK(value_of<int>("document.querySelectorAll('script').length") == 0);
  CHECK(value_of<int>("document.images.length") == 8);
  CHECK(browser().complaints() == kNothing);
  CHECK(browser().requests() == kNothing);
}

TEST_CASE("the checks of this file see what they look for") {
  show(
      "<!DOCTYPE html><html><head><title>t</title></head><body>"
      "<p style='width:2000px;background:#000;color:#555;font-size:9px'>small, grey and wide</p>"
      "<img src='missing.png'><img src='data:image/png;base64,AAAA' alt='damaged'>"
      "<script>console.error('told'); undefinedFunction();</script></body></html>",
      400, false);
  std::string all;
  for (const std::string& problem : audit()) all += problem + '\n';
  for (const char* expected :
       {"2008 pixels wide in a window of 400", "text of 9.0 pixels", "text of contrast",
        "an image without a description", "did not load: damaged"}) {
    CAPTURE(expected, all);
    CHECK(all.find(expected) != std::string::npos);
  }
  std::string said;
  for (const std::string& complaint : browser().complaints()) said += complaint + '\n';
  CAPTURE(said);
  CHECK(said.find("told") != std::string::npos);
  CHECK(said.find("Uncaught") != std::string::npos);
  REQUIRE(browser().requests().size() == 1);
  CHECK(browser().requests()[0].find("missing.png") != std::string::npos);
}

TEST_CASE("the page forbids the browser to load or run anything") {
  std::string html = page_html(awkward_page());
  const std::size_t end = html.find("</main>");
  REQUIRE(end != std::string::npos);
  html.insert(end,
              "<script>document.title = 'changed'</script><img src='missing.png' alt='missing'>");
  show(html, 1280, false);
  CHECK(value_of<std::string>("document.title") == awkward_page().title);
  CHECK(browser().complaints().size() == 2);
}
