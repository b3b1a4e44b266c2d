// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/page.h"

#include <algorithm>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "svg_document.h"

using namespace sarnerf;

namespace {

const std::string kDoctype = "<!DOCTYPE html>\n";
const std::string kAttack = "a<b & \"c\" 'd' </p><script>alert(1)</script> \x01\xFF";
const std::string kSeen = "a<b & \"c\" 'd' </p><script>alert(1)</script> \xEF\xBF\xBD\xEF\xBF\xBD";

/// The elements of a page, strictly read as XML.
std::vector<SvgElement> parsed(const Page& page) {
  const std::string html = page_html(page);
  REQUIRE(html.compare(0, kDoctype.size(), kDoctype) == 0);
  return parse_svg(html.substr(kDoctype.size()));
}

Plot small_plot() {
  Plot plot;
  plot.title = kAttack;
  plot.series = {{kAttack, {{0.0, 1.0}, {1.0, 2.0}}}};
  return plot;
}

/// One block of each kind, with markup wherever there is text.
Page full_page() {
  Page page;
  page.title = page.subtitle = kAttack;
  Image<Colour> strip(1, 3);
  page.blocks = {
      PageHeading{kAttack},
      PageParagraph{kAttack},
      PageNotice{kAttack, PageNotice::Kind::warning},
      PageNotice{kAttack, PageNotice::Kind::note},
      PageFigures{{{kAttack, kAttack}}},
      PageFacts{kAttack, {{kAttack, kAttack}}},
      PageTable{kAttack, {{kAttack}, {kAttack, Align::right}}, {{kAttack, kAttack}}, {0}, false},
      PageHeading{"second"},
      PageTable{kAttack, {{kAttack}}, {{kAttack}}, {}, true},
      PagePlot{small_plot(), kAttack},
      PagePictures{{{Image<std::uint8_t>(2, 3, 7), kAttack, kAttack}}, kAttack},
      PageScales{{{kAttack, strip, {kAttack, kAttack}}}}};
  return page;
}

/// The bytes behind a data URI: an independent reading of RFC 4648, six bits a letter.
std::vector<unsigned char> bytes_of(const std::string& uri) {
  const std::string head = "data:image/png;base64,";
  REQUIRE(uri.compare(0, head.size(), head) == 0);
  REQUIRE((uri.size() - head.size()) % 4 == 0);
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<bool> bits;
  for (const char c : uri.substr(head.size())) {
    if (c == '=') continue;
    const auto digit = letters.find(c);
    REQUIRE(digit != std::string::npos);
    for (int b = 5; b >= 0; --b) bits.push_back((digit >> b & 1u) != 0);
  }
  std::vector<unsigned char> bytes(bits.size() / 8);
  for (std::size_t n = 0; n < 8 * bytes.size(); ++n) {
    bytes[n / 8] = static_cast<unsigned char>(bytes[n / 8] << 1 | (bits[n] ? 1 : 0));
  }
  return bytes;
}

std::string message_of(const std::function<void(Page&)>& change) {
  Page page = full_page();
  change(page);
  try {
    page_html(page);
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("a page is well-formed, names its language and title, and forbids what it does not bring") {
  const auto all = parsed(full_page());
  CHECK(all.front().name == "html");
  CHECK(all.front().attributes.at("lang") == "en");
  REQUIRE(elements_of(all, "title").size() == 1);
  CHECK(elements_of(all, "title")[0].text == kSeen);
  std::set<std::string> metas;
  for (const SvgElement& meta : elements_of(all, "meta")) {
    for (const auto& [name, value] : meta.attributes) metas.insert(name + '=' + value);
  }
  CHECK(metas.count("charset=utf-8") == 1);
  CHECK(metas.count("name=viewport") == 1);
  CHECK(metas.count("content=default-src 'none'; img-src data:; style-src 'unsafe-inline'") == 1);
}

TEST_CASE("a page refers to nothing outside of itself and runs nothing") {
  for (const SvgElement& element : parsed(full_page())) {
    CAPTURE(element.name);
    CHECK(element.name != "script");
    CHECK(element.name != "link");
    for (const auto& [name, value] : element.attributes) {
      CHECK(name.compare(0, 2, "on") != 0);
      if (name == "src") CHECK(value.compare(0, 15, "data:image/png;") == 0);
      if (name == "href") CHECK(value.compare(0, 9, "#section-") == 0);
    }
  }
  const std::string html = page_html(full_page());
  CHECK(html.find("url(") == std::string::npos);
  CHECK(html.find("@import") == std::string::npos);
}

TEST_CASE("texts come through as they are, markup and all, each in its place") {
  const auto all = parsed(full_page());
  const auto seen = [&](const std::string& name) {
    const auto elements = elements_of(all, name);
    return std::count_if(elements.begin(), elements.end(),
                         [](const SvgElement& e) { return e.text == kSeen; });
  };
  CHECK(seen("h1") == 1);
  CHECK(seen("h2") == 1);
  CHECK(seen("a") == 1);           // the heading in the list of contents
  CHECK(seen("caption") == 1);     // of the facts
  CHECK(seen("summary") == 1);     // of the folded table
  CHECK(seen("figcaption") == 3);  // of the table, the plot and the picture
  CHECK(seen("th") == 6);          // a fact's name, three columns, two rows
  CHECK(seen("td") == 2);
  CHECK(elements_of(all, "img").front().attributes.at("alt") == kSeen);
}

TEST_CASE("pictures hold the pixels that they were given") {
  Image<std::uint8_t> grey(3, 5);
  Image<Colour> colour(2, 4);
  for (std::size_t n = 0; n < 15; ++n) grey.pixels()[n] = std::uint8_t(17 * n);
  for (std::size_t n = 0; n < 8; ++n) {
    colour.pixels()[n] = {std::uint8_t(30 * n), std::uint8_t(255 - n), std::uint8_t(100 + 7 * n)};
  }
  Page page;
  page.blocks = {PagePictures{{{grey, "", "grey"}, {colour, "", "colour"}}, ""}};
  const auto images = elements_of(parsed(page), "img");
  REQUIRE(images.size() == 2);
  CHECK(images[0].number("width") == 5.0);
  CHECK(images[0].number("height") == 3.0);
  const cv::Mat first =
      cv::imdecode(bytes_of(images[0].attributes.at("src")), cv::IMREAD_UNCHANGED);
  const cv::Mat second =
      cv::imdecode(bytes_of(images[1].attributes.at("src")), cv::IMREAD_UNCHANGED);
  REQUIRE((first.type() == CV_8UC1 && first.rows == 3 && first.cols == 5));
  REQUIRE((second.type() == CV_8UC3 && second.rows == 2 && second.cols == 4));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 5; ++j) CHECK(first.at<std::uint8_t>(i, j) == grey(i, j));
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 4; ++j) {
      const Colour& c = colour(i, j);
      CHECK(second.at<cv::Vec3b>(i, j) == cv::Vec3b(c[2], c[1], c[0]));
    }
  }
}

TEST_CASE("a plot stands there twice, and its narrow drawing keeps legible text") {
  Page page;
  page.blocks = {PagePlot{small_plot(), ""}};
  const auto drawings = elements_of(parsed(page), "svg");
  REQUIRE(drawings.size() == 2);
  CHECK(drawings[0].number("width") == 800.0);
  CHECK(drawings[1].number("width") <= 320.0);
}

TEST_CASE("dark paper knows every colour that plots use for paper and ink") {
  // A colour of the plots that the style sheet does not name would stay as it is on dark paper.
  const auto all = parsed(full_page());
  const std::string style = elements_of(all, "style")[0].text;
  for (const char* colour : {"#ffffff", "#1a1a1a", "#4d4d4d", "#e4e4e4", "#c8c8c8"}) {
    for (const char* paint : {"fill", "stroke"}) {
      CAPTURE(colour, paint);
      CHECK(style.find(std::string("[") + paint + "=\"" + colour + "\"]") != std::string::npos);
    }
  }
  for (const SvgElement& text : elements_of(all, "text")) {
    const auto fill = text.attributes.find("fill");
    if (fill != text.attributes.end())
      CHECK(style.find("[fill=\"" + fill->second + "\"]") != std::string::npos);
  }
}

TEST_CASE("the list of contents names every section, and one section needs none") {
  const auto all = parsed(full_page());
  const auto headings = elements_of(all, "h2"), links = elements_of(all, "a");
  REQUIRE(headings.size() == 2);
  REQUIRE(links.size() == 2);
  for (std::size_t n = 0; n < 2; ++n)
    CHECK(links[n].attributes.at("href") == "#" + headings[n].attributes.at("id"));
  Page page;
  page.blocks = {PageHeading{"alone"}};
  CHECK(elements_of(parsed(page), "nav").empty());
}

TEST_CASE("the same page gives the same bytes, and an empty one is a page") {
  CHECK(page_html(full_page()) == page_html(full_page()));
  CHECK(elements_of(parsed({}), "h1")[0].text == "Report");
}

TEST_CASE("what cannot be shown is refused in one line") {
  CHECK(message_of([](Page&) {}).empty());
  const auto last = [](Page& page, const PageBlock& block) { page.blocks.push_back(block); };
  const std::vector<PageBlock> bad{
      PageTable{"t", {}, {}, {}, false},
      PageTable{"t", {{"a"}, {"b"}}, {{"1", "2"}, {"1"}}, {}, false},
      PageTable{"", {{"a"}}, {{"1"}}, {}, true},
      PagePictures{{{Image<std::uint8_t>(), "name", "description"}}, ""},
      PagePictures{{{Image<std::uint8_t>(1, 1), "name", ""}}, ""},
      PageScales{{{"s", Image<Colour>(2, 2), {}}}},
      PagePlot{}};
  for (const PageBlock& block : bad) {
    const std::string message = message_of([&](Page& page) { last(page, block); });
    CAPTURE(block.index(), message);
    CHECK(message.find("expected") != std::string::npos);
    CHECK(message.find('\n') == std::string::npos);
  }
  CHECK(message_of([&](Page& page) { last(page, bad[1]); }) ==
        "page: table 't': expected 2 cells in row 1, found 1");
}
