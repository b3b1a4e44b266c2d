// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/plot.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/image_file.h"
#include "scratch_folder.h"
#include "svg_document.h"

using namespace sarnerf;

namespace {

Plot one_series(bool emphasised) {
  Plot plot;
  plot.title = "Title";
  plot.x = {"time (ms)", AxisScale::log};
  plot.y = {"error (%)", AxisScale::log};
  plot.series = {{"series", {{1.0, 10.0}, {10.0, 1.0}, {100.0, 0.1}}}};
  plot.series[0].emphasised = emphasised;
  return plot;
}

cv::Mat decoded(const std::vector<std::byte>& png) {
  return cv::imdecode(cv::Mat(1, int(png.size()), CV_8UC1, const_cast<std::byte*>(png.data())),
                      cv::IMREAD_UNCHANGED);
}

}  // namespace

TEST_CASE(
    "a plot without colours is read back as a grey image: ink on white, of the size asked for") {
  const ScratchFolder folder;
  const std::string plot = svg(one_series(true));
  for (const double scale : {0.75, 1.0, 1.6}) {
    const auto png = png_of_svg(plot, scale);
    write_text(folder / "plot.png", {reinterpret_cast<const char*>(png.data()), png.size()});
    const Image<float> image = read_image(folder / "plot.png");
    CHECK(image.n_range() == int(std::ceil(800 * scale)));
    CHECK(image.n_azimuth() == int(std::ceil(540 * scale)));
    const auto [darkest, lightest] =
        std::minmax_element(image.pixels().begin(), image.pixels().end());
    CHECK(*darkest < 64.0f);
    CHECK(*lightest == 255.0f);
    CHECK(image(0, 0) == 255.0f);
    const auto inked = std::count_if(image.pixels().begin(), image.pixels().end(),
                                     [](float p) { return p < 128.0f; });
    CHECK(double(inked) > 0.005 * double(image.pixels().size()));
    CHECK(double(inked) < 0.2 * double(image.pixels().size()));
  }
}

TEST_CASE("markers have their colour where the SVG says that they are") {
  const std::string plot = svg(one_series(false));
  const cv::Mat image = decoded(png_of_svg(plot, 2.0));
  REQUIRE(image.type() == CV_8UC3);
  int seen = 0;
  for (const SvgElement& path : elements_of(parse_svg(plot), "path", "data")) {
    if (path.attributes.at("d").find('a') == std::string::npos) continue;
    const Spot centre = centre_of_circle(path);
    const auto bgr = image.at<cv::Vec3b>(int(2.0 * centre.y), int(2.0 * centre.x));
    CHECK(bgr == cv::Vec3b(0xb2, 0x72, 0x00));
    ++seen;
  }
  CHECK(seen == 3);
}

TEST_CASE("a document without a background stands on white") {
  const cv::Mat image =
      decoded(png_of_svg("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"4\" height=\"3\"/>"));
  REQUIRE(image.type() == CV_8UC3);
  CHECK((image.cols == 4 && image.rows == 3));
  for (int row = 0; row < 3; ++row)
    CHECK(image.at<cv::Vec3b>(row, row) == cv::Vec3b(255, 255, 255));
}

TEST_CASE("the same picture gives the same bytes") {
  const std::string plot = svg(one_series(false));
  CHECK(png_of_svg(plot, 1.0) == png_of_svg(plot, 1.0));
}

TEST_CASE("text is drawn, in whichever of the named fonts there is") {
  Plot plot = one_series(true);
  const auto without = png_of_svg(svg(plot));
  plot.title = "Another";
  CHECK(png_of_svg(svg(plot)) != without);
}

TEST_CASE("what cannot be drawn is refused") {
  const std::string plot = svg(one_series(false));
  for (const double scale : {0.0, -1.0, double(NAN), double(INFINITY), 1000.0, 30.0}) {
    CAPTURE(scale);
    CHECK_THROWS_AS(png_of_svg(plot, scale), UsageError);
  }
  CHECK_THROWS_AS(png_of_svg(""), InputError);
  CHECK_THROWS_AS(png_of_svg("no markup"), InputError);
  CHECK_THROWS_AS(png_of_svg(plot.substr(0, plot.size() / 2)), InputError);
  CHECK_THROWS_AS(
      png_of_svg("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"50%\" height=\"50%\"/>"),
      InputError);
}
