// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/geometry/ray_grid.h"

#include <algorithm>

#include "acquisitions.h"
#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Box scene_box(const Acquisition& a) {
  Box box;
  box.include(a.aim_m + glm::dvec3(-14, -1, -22));
  box.include(a.aim_m + glm::dvec3(30, 15, 9));
  return box;
}

}  // namespace

TEST_CASE("points in float32 are those of the direct computation, at every altitude") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> swath(-30.0, 30.0);
  for (double altitude_m : kAllAltitudes_m) {
    double worst = 0.0;
    for (int trial = 0; trial < 300; ++trial) {
      const Acquisition a = random_acquisition(random, altitude_m);
      const RayGrid grid(a, make_fan(angular_extent(a, scene_box(a)), 41));
      const WideFrame wide(a);
      for (int k = 0; k < 41; k += 4) {
        const double along_m = swath(random), offset_m = swath(random);
        const long double angle = grid.fan().ray_angle_rad(k);
        const Wide direction = std::cos(angle) * wide.k + std::sin(angle) * wide.v;
        const long double t =
            static_cast<long double>(a.slant_range_m) + static_cast<long double>(offset_m);
        const Wide expected =
            wide.radar + static_cast<long double>(along_m) * wide.h + t * direction;
        const glm::vec3 point(grid.point_from_aim_m(along_m, offset_m, k));
        worst = worse(worst, error_m(glm::dvec3(point), expected));
      }
    }
    INFO("altitude " << altitude_m << " m: " << worst << " m");
    CHECK(worst < 1e-5);
  }
}

TEST_CASE("points project to where they were made") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> swath(-30.0, 30.0);
  for (double altitude_m : kAllAltitudes_m) {
    const Acquisition a = random_acquisition(random, altitude_m);
    const RayGrid grid(a, make_fan(angular_extent(a, scene_box(a)), 16));
    for (int k = 0; k < 16; ++k) {
      const double along_m = swath(random), offset_m = swath(random);
      const glm::dvec3 point = grid.point_from_aim_m(along_m, offset_m, k);
      // Without the aim point's large coordinates, whose rounding is not the grid's.
      Acquisition centred = a;
      centred.aim_m = glm::dvec3(0.0);
      const RadarPoint found = project(centred, grid.frame(), point);
      CHECK(found.along_track_m == within_margin(along_m, 1e-10));
      CHECK(found.range_offset_m == within_margin(offset_m, 1e-10));
      CHECK(std::abs(found.ray_angle_rad - grid.fan().ray_angle_rad(k)) * a.slant_range_m < 1e-7);
    }
  }
}

TEST_CASE("the fan covers the box, no more, and need not be symmetric") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (double altitude_m : kAllAltitudes_m) {
    const Acquisition a = random_acquisition(random, altitude_m);
    const Box box = scene_box(a);
    const auto [first, last] = angular_extent(a, box);
    const RadarFrame frame = radar_frame(a);
    double lowest = 1.0, highest = -1.0;
    for (int n = 0; n < 3000; ++n) {
      const glm::dvec3 p =
          box.min + box.size() * glm::dvec3(unit(random), unit(random), unit(random));
      const double angle = project(a, frame, p).ray_angle_rad;
      lowest = std::min(lowest, angle);
      highest = std::max(highest, angle);
    }
    const double width = last - first;
    CHECK(first <= lowest);
    CHECK(last >= highest);
    double lowest_corner = 1.0, highest_corner = -1.0;  // the box is convex: no point of it is outside of these
    for (const glm::dvec3& corner : box.corners()) {
      const double angle = project(a, frame, corner).ray_angle_rad;
      lowest_corner = std::min(lowest_corner, angle);
      highest_corner = std::max(highest_corner, angle);
    }
    CHECK(first == within_margin(lowest_corner, 1e-9 * width));
    CHECK(last == within_margin(highest_corner, 1e-9 * width));
    CHECK(std::abs(first + last) > 1e-3 * width);

    const Fan fan = make_fan({first, last}, 10);
    CHECK(fan.first_angle_rad == first);
    CHECK(fan.last_angle_rad() == Approx(last));
    CHECK(fan.ray_angle_rad(0) == Approx(first + 0.05 * width));
    CHECK(fan.ray_angle_rad(9) == Approx(last - 0.05 * width));
  }
}

TEST_CASE("positive ray angles raise the incidence, in either look") {
  for (Look look : {Look::right, Look::left}) {
    Acquisition a = acquisition(40, 70, 1e4);
    a.look = look;
    const RayGrid grid(a, make_fan({-0.01, 0.02}, 3));
    for (int k = 0; k < 3; ++k) {
      const double incidence = std::acos(-grid.direction(k).y);
      CHECK(incidence == Approx(a.incidence_rad + grid.fan().ray_angle_rad(k)));
      CHECK(glm::length(grid.direction(k)) == Approx(1.0).epsilon(1e-15));
    }
  }
}

TEST_CASE("looking left mirrors the image's rows") {
  Acquisition a = acquisition(40, 70, 1e4);
  const glm::dvec3 p(3.0, 2.0, -5.0);
  const RadarPoint right = project(a, radar_frame(a), p);
  a.look = Look::left;
  const RadarPoint left = project(a, radar_frame(a), p);
  CHECK(left.along_track_m == -right.along_track_m);
  CHECK(left.range_offset_m == right.range_offset_m);
  CHECK(left.ray_angle_rad == right.ray_angle_rad);
}

TEST_CASE("the ground's extent is where the swath's borders meet the plane") {
  for (double incidence_deg : {20.0, 45.0, 70.0}) {
    for (double altitude_m : kAllAltitudes_m) {
      const Acquisition a = acquisition(incidence_deg, 10, altitude_m);
      for (double ground_m : {0.0, -2.5, 1.5}) {
        const auto extent = ground_angular_extent(a, ground_m);
        REQUIRE(extent);
        const double ends[2] = {a.bin_offset_m(-0.5), a.bin_offset_m(a.n_range - 0.5)};
        const double angles[2] = {extent->first, extent->second};
        const double height_m = a.altitude_m() - ground_m;
        for (int end = 0; end < 2; ++end) {
          if (a.slant_range_m + ends[end] < height_m) {  // too near for any point of the plane
            CHECK(angles[end] == Approx(-a.incidence_rad));
            continue;
          }
          const RayGrid ray(a, {angles[end] - 1e-12, 2e-12, 1});
          CHECK(ray.point_from_aim_m(0.0, ends[end], 0).y == within_margin(ground_m, 1e-6));
        }
      }
    }
  }
}

TEST_CASE(
    "a swath that ends above the ground sees none of it; one that begins above sees its foot") {
  Acquisition a = acquisition(2, 0, 1000);
  CHECK_FALSE(ground_angular_extent(a, a.aim_m.y - 500.0));
  CHECK_FALSE(ground_angular_extent(a, a.aim_m.y + 1001.0));
  a.n_range = 200;
  const auto extent = ground_angular_extent(a, 0.0);
  REQUIRE(extent);
  CHECK(extent->first == Approx(-a.incidence_rad));  // straight down
}

TEST_CASE("a fan needs rays and an angle") {
  CHECK_THROWS_AS(make_fan({-0.1, 0.1}, 0), GeometryError);
  CHECK_THROWS_AS(make_fan({0.1, 0.1}, 5), GeometryError);
  CHECK_THROWS_AS(make_fan({0.1, -0.1}, 5), GeometryError);
}

TEST_CASE("boxes") {
  Box box;
  CHECK(box.empty());
  box.include({1, 2, 3});
  CHECK_FALSE(box.empty());
  CHECK(box.size() == glm::dvec3(0.0));
  box.include({-1, 4, 3});
  CHECK(box.centre() == glm::dvec3(0, 3, 3));
  CHECK(box.corners()[0] == box.min);
  CHECK(box.corners()[7] == box.max);
}
