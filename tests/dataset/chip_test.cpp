// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/phoenix.h"

#include <array>
#include <cmath>

#include "catch.h"
#include "phoenix_chips.h"
#include "posed_images.h"
#include "sarnerf/core/error.h"
#include "sarnerf/evaluation/baseline.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

PosedImage posed(const Chip& chip) {
  return {chip.view.source, acquisition_of(chip.view, glm::dvec3(0.0)), chip.image};
}

double correlation(const Image<float>& a, const Image<float>& b) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  const auto n = static_cast<double>(a.pixels().size());
  for (std::size_t p = 0; p < a.pixels().size(); ++p) {
    const double x = a.pixels()[p], y = b.pixels()[p];
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  return (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
}

constexpr std::array kTarget{GroundPoint{2.0, 0.5}, GroundPoint{-1.0, 2.5}, GroundPoint{0.5, -2.0}};

}  // namespace

TEST_CASE("a chip is read unmirrored: rows from far to near, columns against the rows of azimuth") {
  const PhoenixChip phoenix = numbered_chip();
  const Chip chip = chip_of(phoenix, 9999.0);
  REQUIRE(chip.view.n_azimuth == 40);
  REQUIRE(chip.view.n_range == 48);
  CHECK(chip.image(0, 0) == phoenix.magnitude(47, 39));
  CHECK(chip.image(39, 0) == phoenix.magnitude(47, 0));
  CHECK(chip.image(3, 40) == phoenix.magnitude(7, 36));
  CHECK(chip.view.axes == std::array{Axis::plus_i, Axis::plus_j});
  CHECK(chip.view.azimuth_spacing_m == 0.21);
  CHECK(chip.view.range_spacing_m == 0.2);
  CHECK(chip.view.class_name == "bmp2_tank");
  CHECK(chip.view.serial == "9563");
  CHECK(chip.view.source == "hb03787.0000");
}

TEST_CASE("measured angles and ranges go before desired ones, and those before what is assumed") {
  PhoenixChip phoenix = numbered_chip();
  Chip chip = chip_of(phoenix, 9999.0);
  CHECK(chip.view.incidence_deg == 90.0 - 17.09375);
  CHECK(chip.view.slant_range_m == 4475.0);
  CHECK(chip.nominal_depression_deg == 17.0);
  CHECK_FALSE(chip.depression_is_nominal);
  CHECK_FALSE(chip.range_is_assumed);

  phoenix.measured_depression_deg = phoenix.measured_range_m = std::nullopt;
  chip = chip_of(phoenix, 9999.0);
  CHECK(chip.view.incidence_deg == 73.0);
  CHECK(chip.view.slant_range_m == 4500.0);
  CHECK(chip.depression_is_nominal);

  phoenix.desired_range_m = std::nullopt;
  chip = chip_of(phoenix, 9999.0);
  CHECK(chip.view.slant_range_m == 9999.0);
  CHECK(chip.range_is_assumed);

  phoenix = numbered_chip();
  phoenix.desired_depression_deg = std::nullopt;
  phoenix.target_azimuth_deg = -10.0;
  chip = chip_of(phoenix, 9999.0);
  CHECK(chip.nominal_depression_deg == 17.0);
  CHECK(chip.view.azimuth_deg == 350.0);

  phoenix.measured_depression_deg = 0.25;
  phoenix.target_azimuth_deg = -1e-30;
  chip = chip_of(phoenix, 9999.0);
  CHECK(chip.nominal_depression_deg == 0.25);
  CHECK(chip.view.azimuth_deg == 0.0);
}

TEST_CASE("points of a drawn chip lie where the project's geometry sees them") {
  for (const double azimuth_deg : {0.0, 37.0, 90.0, 200.0}) {
    for (const GroundPoint& point : kTarget) {
      const Chip chip = chip_of(drawn_chip(std::array{point}, azimuth_deg), 1e6);
      const Acquisition a = acquisition_of(chip.view, glm::dvec3(0.0));
      // At azimuth 0 the picture's right is +X, and away from the radar is −Z.
      const RadarPoint seen = project(a, radar_frame(a), {point.right_m, 0.0, -point.up_m});
      Image<float> peak = chip.image;
      for (float& p : peak.pixels()) p = p > 0.1f ? p : 0.0f;
      const glm::dvec2 found = centroid_m(a, peak);
      CAPTURE(azimuth_deg, point.right_m, point.up_m);
      CHECK(found.x == Approx(seen.along_track_m).margin(0.02));
      CHECK(found.y == Approx(seen.range_offset_m).margin(0.02));
    }
  }
}

TEST_CASE("turning one chip onto another works in the sense of growing azimuth only") {
  const Chip from = chip_of(drawn_chip(kTarget, 40.0), 1e6),
             to = chip_of(drawn_chip(kTarget, 55.0), 1e6);
  const auto turned = [&](double by_deg) {
    Acquisition wanted = posed(from).acquisition;
    wanted.azimuth_rad += rad_from_deg(by_deg);
    return interpolate_view(std::vector{posed(from)}, wanted, Interpolation::rotated_linear);
  };
  CHECK(correlation(turned(15.0), to.image) > 0.95);
  CHECK(correlation(turned(-15.0), to.image) < 0.5);
  CHECK(correlation(turned(0.0), to.image) < 0.8);
}

TEST_CASE("views become Phoenix chips and come back") {
  DatasetView view = chip_of(numbered_chip(), 0.0).view;
  view.azimuth_deg = 123.456789;
  view.incidence_deg = 73.0;
  const Image<float> image = chip_of(numbered_chip(), 0.0).image;
  for (const Look look : {Look::right, Look::left}) {
    view.look = look;
    const PhoenixChip phoenix = phoenix_of(view, image);
    const Chip back = chip_of(parse_phoenix(encode_phoenix(phoenix), "chip"), 0.0);
    CHECK(back.view.azimuth_deg == view.azimuth_deg);
    CHECK(back.view.depression_deg() == view.depression_deg());
    CHECK(back.view.slant_range_m == view.slant_range_m);
    CHECK(back.view.look == Look::right);
    CHECK(back.view.class_name == view.class_name);
    for (const int i : {0, 5, 39})
      for (const int j : {0, 7, 47})
        CHECK(back.image(look == Look::right ? i : 39 - i, j) == image(i, j));
  }
  CHECK_THROWS_AS(phoenix_of(view, Image<float>(2, 2)), UsageError);
}

TEST_CASE("a crop keeps the middle") {
  const Chip whole = chip_of(numbered_chip(), 0.0);
  const Chip middle = cropped(whole, 20, 31, "chip");
  CHECK(middle.view.n_azimuth == 20);
  CHECK(middle.view.n_range == 31);
  CHECK(middle.image(0, 0) == whole.image(10, 8));
  CHECK(middle.image(19, 30) == whole.image(29, 38));
  CHECK(middle.view.slant_range_m == whole.view.slant_range_m);
  CHECK_THROWS_WITH(cropped(whole, 41, 48, "chip"),
                    "chip: 40 x 48 pixels (azimuth x range) cannot be cropped to 41 x 48; choose a "
                    "smaller crop or leave "
                    "this image out");
}
