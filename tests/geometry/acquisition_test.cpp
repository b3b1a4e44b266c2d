// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <string>

#include "acquisitions.h"
#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

void check_equal(const glm::dvec3& a, const glm::dvec3& b) {
  for (int axis = 0; axis < 3; ++axis) CHECK(a[axis] == within_margin(b[axis], 1e-15));
}

std::string message_of(const Acquisition& a) {
  try {
    validate(a);
  } catch (const GeometryError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("the frame is orthonormal, h × v = k, and looking left mirrors h") {
  for (double incidence : {1.0, 20.0, 35.0, 45.0, 70.0, 89.0}) {
    for (double azimuth : {-30.0, 0.0, 45.0, 90.0, 123.0, 270.0}) {
      Acquisition a = acquisition(incidence, azimuth, 1e4);
      const RadarFrame right = radar_frame(a);
      check_equal(glm::cross(right.h, right.v), right.k);
      CHECK(glm::length(right.h) == Approx(1.0));
      CHECK(glm::length(right.v) == Approx(1.0));
      CHECK(glm::dot(right.h, right.v) == within_margin(0.0, 1e-15));
      a.look = Look::left;
      const RadarFrame left = radar_frame(a);
      check_equal(left.h, -right.h);
      check_equal(left.v, right.v);
      check_equal(left.k, right.k);
    }
  }
}

TEST_CASE("columns of the matrix of printed eq. 19") {
  // At 90° of azimuth, 30° of incidence: sin φ = 1, cos φ = 0, sin θ = 1/2, cos θ = √3/2.
  const RadarFrame frame = radar_frame(acquisition(30, 90, 1e4));
  const double c = std::sqrt(0.75);
  check_equal(frame.h, {0, 0, 1});
  check_equal(frame.v, {-c, 0.5, 0});
  check_equal(frame.k, {-0.5, -c, 0});
}

TEST_CASE("at azimuth 0 the radar stands over +Z, and azimuth grows towards +X") {
  const auto ground_track = [](double azimuth_deg) {
    const Acquisition a = acquisition(45, azimuth_deg, 1e4);
    return glm::normalize(-radar_frame(a).k * glm::dvec3(1, 0, 1));
  };
  check_equal(ground_track(0), {0, 0, 1});
  check_equal(ground_track(90), {1, 0, 0});
  check_equal(ground_track(180), {0, 0, -1});
  CHECK(radar_frame(acquisition(45, 0, 1e4)).k.y < 0.0);
  // The track runs to the left of the radar's own line of sight: it looks to its right.
  const RadarFrame frame = radar_frame(acquisition(45, 0, 1e4));
  const glm::dvec3 right_of_track = glm::cross(frame.h, glm::dvec3(0, 1, 0));
  CHECK(glm::dot(right_of_track, frame.k) > 0.0);
}

TEST_CASE("incidence is measured from the vertical, and altitude from the aim point") {
  const Acquisition a = acquisition(35, 20, 1e4);
  CHECK(a.altitude_m() == Approx(1e4));
  CHECK(std::acos(glm::dot(-radar_frame(a).k, glm::dvec3(0, 1, 0))) == Approx(rad_from_deg(35)));
}

TEST_CASE("rows and bins are centred on the aim point") {
  const Acquisition a = acquisition(35, 20, 1e4);
  CHECK(a.row_offset_m(0) == Approx(-31.5 * 0.4));
  CHECK(a.row_offset_m(31) == Approx(-a.row_offset_m(32)));
  CHECK(a.bin_offset_m(0) == Approx(-47.5 * 0.3));
  CHECK(a.range_m(47.5) == Approx(a.slant_range_m));
}

TEST_CASE("rows and bins follow from places as places do from them") {
  const Acquisition a = acquisition(35, 20, 1e4);
  CHECK(a.row_of(0.0) == 31.5);
  CHECK(a.bin_of(0.0) == 47.5);
  CHECK(a.row_of(0.4) == Approx(32.5));
  CHECK(a.bin_of(-0.3) == Approx(46.5));
  for (double n : {-7.0, 0.0, 0.25, 12.5, 63.0, 200.0}) {
    CHECK(a.row_of(a.row_offset_m(n)) == within_margin(n, 1e-12));
    CHECK(a.bin_of(a.bin_offset_m(n)) == within_margin(n, 1e-12));
  }
}

TEST_CASE("a ray meets a level plane where its range puts it") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> height(-20.0, 20.0), angle(-0.05, 0.05), offset(-100.0, 100.0);
  for (double altitude_m : kAllAltitudes_m) {
    double worst_height = 0.0, worst_plane = 0.0;
    for (double incidence_deg : {10.0, 35.0, 60.0, 80.0}) {
      const Acquisition a = acquisition(incidence_deg, 20, altitude_m);
      for (int trial = 0; trial < 200; ++trial) {
        const double height_m = height(random), delta = angle(random), s = offset(random);
        const long double theta = a.incidence_rad, r = a.slant_range_m;
        const long double radar_m = r * std::cos(theta) - height_m, cosine = std::cos(theta + delta);
        const long double over_m = radar_m - (r + s) * cosine;
        worst_height = worse(worst_height, double(std::abs(height_over_plane_m(a, height_m, delta, s) - over_m)));
        const double meets_m = plane_range_offset_m(a, height_m, delta);
        worst_plane = worse(worst_plane, double(std::abs((meets_m - (radar_m / cosine - r)) / (r / cosine))));
        CHECK(height_over_plane_m(a, height_m, delta, meets_m) == within_margin(0.0, 1e-14 * double(r)));
      }
    }
    INFO("altitude " << altitude_m << " m");
    CHECK(worst_height < 1e-14 * altitude_m + 1e-10);
    CHECK(worst_plane < 1e-14);
  }
}

TEST_CASE("rays beyond the horizon and behind the nadir meet no level plane") {
  const Acquisition a = acquisition(35, 20, 1e4);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  CHECK(plane_range_offset_m(a, 0.0, rad_from_deg(55)) == kInfinity);
  CHECK(plane_range_offset_m(a, 0.0, rad_from_deg(56)) == kInfinity);
  CHECK(plane_range_offset_m(a, 0.0, rad_from_deg(-35)) == kInfinity);
  CHECK(plane_range_offset_m(a, 0.0, rad_from_deg(-40)) == kInfinity);
  CHECK(plane_range_offset_m(a, 0.0, 0.0) == 0.0);
}

TEST_CASE("projection agrees with the direct computation at every altitude") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> scene(-40.0, 40.0);
  for (double altitude_m : kAllAltitudes_m) {
    double worst_range = 0.0, worst_track = 0.0, worst_across = 0.0;
    for (int trial = 0; trial < 2000; ++trial) {
      const Acquisition a = random_acquisition(random, altitude_m);
      const glm::dvec3 world = a.aim_m + glm::dvec3(scene(random), scene(random), scene(random));
      const RadarPoint found = project(a, radar_frame(a), world);

      const WideFrame wide(a);
      const Wide from_radar = Wide(world) - Wide(a.aim_m) - wide.radar;
      const long double along_v = glm::dot(from_radar, wide.v),
                        depth = glm::dot(from_radar, wide.k);
      const long double range = std::sqrt(along_v * along_v + depth * depth);
      const long double r = a.slant_range_m;
      worst_range =
          worse(worst_range, static_cast<double>(std::abs(found.range_offset_m - (range - r))));
      worst_track = worse(worst_track,
          static_cast<double>(std::abs(found.along_track_m - glm::dot(from_radar, wide.h))));
      // An error of the angle counts by what it moves across the ray.
      worst_across = worse(worst_across,
          static_cast<double>(range * std::abs(found.ray_angle_rad - std::atan2(along_v, depth))));
    }
    INFO("altitude " << altitude_m << " m");
    CHECK(worst_range < 1e-10);
    CHECK(worst_track < 1e-10);
    CHECK(worst_across < 1e-10);
  }
}

TEST_CASE("acquisitions that have no image are refused, with the reason") {
  const Acquisition good = acquisition(45, 30, 1e4);
  CHECK_NOTHROW(validate(good));
  const auto refused = [&](auto&& change) {
    Acquisition bad = good;
    change(bad);
    return message_of(bad);
  };
  const auto contains = [](const std::string& text, const std::string& part) {
    INFO(text);
    CHECK(text.find(part) != std::string::npos);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  contains(refused([](Acquisition& a) { a.incidence_rad = 0.0; }), "incidence");
  contains(refused([](Acquisition& a) { a.incidence_rad = kPi / 2; }), "incidence");
  contains(refused([](Acquisition& a) { a.incidence_rad = -0.3; }), "incidence");
  contains(refused([](Acquisition& a) { a.incidence_rad = kNan; }), "incidence");
  contains(refused([](Acquisition& a) { a.azimuth_rad = kInfinity; }), "azimuth");
  contains(refused([](Acquisition& a) { a.slant_range_m = kNan; }), "slant range");
  contains(refused([](Acquisition& a) { a.aim_m.z = kNan; }), "aim point");
  contains(refused([](Acquisition& a) { a.azimuth_shift_m = kNan; }), "azimuth shift");
  contains(refused([](Acquisition& a) { a.range_shift_m = kInfinity; }), "range shift");
  contains(refused([](Acquisition& a) { a.range_spacing_m = 0.0; }), "spacing");
  contains(refused([](Acquisition& a) { a.azimuth_spacing_m = -1.0; }), "spacing");
  contains(refused([](Acquisition& a) { a.n_range = 0; }), "1 x 1");
  contains(refused([](Acquisition& a) { a.n_azimuth = -5; }), "1 x 1");
  contains(refused([](Acquisition& a) { a.slant_range_m = 10.0; }), "behind the radar");
  contains(refused([](Acquisition& a) { a.slant_range_m = -1e4; }), "behind the radar");
}
