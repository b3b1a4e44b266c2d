// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <random>

#include "catch.h"
#include "dense_segments.h"
#include "sarnerf/core/units.h"
#include "sarnerf/mpa/volume_march.h"

using namespace sarnerf;
using test::append_segments;

namespace {

Acquisition acquisition(double incidence_deg, double azimuth_deg, double slant_range_m) {
  Acquisition a;
  a.incidence_rad = rad_from_deg(incidence_deg);
  a.azimuth_rad = rad_from_deg(azimuth_deg);
  a.slant_range_m = slant_range_m;
  a.n_azimuth = 8;
  a.n_range = 10;
  a.azimuth_spacing_m = 0.4;
  a.range_spacing_m = 0.3;
  return a;
}

RayGrid narrow_grid(const Acquisition& a, int n_elevation = 7) {
  const double half = 3.0 / a.slant_range_m;
  return RayGrid(a, make_fan({-half, half}, n_elevation));
}

bool inside(const glm::dvec3& p, const Box& box, double margin) {
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] < box.min[axis] - margin || p[axis] > box.max[axis] + margin) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("a ray is clipped where it enters and leaves the box") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int hits = 0, misses = 0;
  for (double slant_range_m : {100.0, 1e4, 7e5, 3.6e7}) {
    for (int trial = 0; trial < 100; ++trial) {
      const Acquisition a = acquisition(10 + 70 * unit(random), 360 * unit(random), slant_range_m);
      const RayGrid grid = narrow_grid(a);
      Box box;
      for (int corner = 0; corner < 2; ++corner) {
        box.include(4.0 * glm::dvec3(unit(random), unit(random), unit(random)) - 2.0);
      }
      const double along = 2.0 * unit(random) - 1.0;
      const int k = trial % 7;
      const RangeInterval found = clip_to_box(grid, along, k, box);
      // An independent look: walk along the ray and ask each point.
      double first = 1e30, last = -1e30;
      for (double s = -6.0; s <= 6.0; s += 1e-3) {
        if (inside(grid.point_from_aim_m(along, s, k), box, 0.0)) {
          first = std::min(first, s);
          last = std::max(last, s);
        }
      }
      if (first > last) {
        ++misses;
        CHECK((found.empty() || found.far_m - found.near_m < 1.1e-3));
      } else {
        ++hits;
        CHECK(found.near_m <= first);
        CHECK(found.near_m > first - 1.1e-3);
        CHECK(found.far_m >= last);
        CHECK(found.far_m < last + 1.1e-3);
      }
    }
  }
  CHECK(hits > 50);
  CHECK(misses > 50);
}

TEST_CASE("rays parallel to faces are in or out, never undefined") {
  // At azimuth 0 and no ray angle in x: d.x = 0 exactly; rows move along −x.
  const Acquisition a = acquisition(40, 0, 1000);
  const RayGrid grid = narrow_grid(a);
  REQUIRE(grid.direction(3).x == 0.0);
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  CHECK_FALSE(clip_to_box(grid, 0.0, 3, box).empty());
  CHECK_FALSE(clip_to_box(grid, 1.0, 3, box).empty());  // within the face
  CHECK_FALSE(clip_to_box(grid, -1.0, 3, box).empty());
  CHECK(clip_to_box(grid, 1.0000001, 3, box).empty());
  CHECK(clip_to_box(grid, 0.0, 3, Box{}).empty());
}

TEST_CASE("nothing behind the radar is seen") {
  const Acquisition a = acquisition(40, 30, 10);
  const RayGrid grid = narrow_grid(a);
  const Box everywhere{glm::dvec3(-1e3), glm::dvec3(1e3)};
  CHECK(clip_to_box(grid, 0.0, 3, everywhere).near_m == -10.0);
}

TEST_CASE("segments tile the interval, each inside its bin") {
  const Acquisition a = acquisition(35, 70, 1e4);
  const RayGrid grid = narrow_grid(a);
  const double swath = 0.5 * a.n_range * a.range_spacing_m;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 300; ++trial) {
    const RangeInterval interval{-2.5 + 4.0 * unit(random), -1.0 + 5.0 * unit(random)};
    SampleBatch batch;
    begin_ray(batch, grid, 2, 5);
    append_segments(batch, grid, 0.1, 5, interval);
    REQUIRE(batch.ray_begin ==
            std::vector<std::uint32_t>{0, static_cast<std::uint32_t>(batch.n_segments())});
    const double far_m = std::min(interval.far_m, swath);
    double s = interval.near_m;
    for (std::size_t n = 0; n < batch.n_segments(); ++n) {
      const double length = static_cast<double>(batch.length_m[n]);
      CHECK(length > 0.0);
      CHECK(length <= a.range_spacing_m * (1 + 1e-6));
      const double centre = s + 0.5 * length;
      const double j = std::floor(centre / a.range_spacing_m + 0.5 * a.n_range);
      CHECK(batch.bin[n] == (j < 0 ? kNoBin : static_cast<std::uint32_t>(j)));
      if (j >= 0) CHECK(std::abs(centre - a.bin_offset_m(j)) <= 0.5 * a.range_spacing_m);
      const glm::dvec3 expected = grid.point_from_aim_m(0.1, centre, 5);
      CHECK(glm::length(glm::dvec3(batch.point_m[n]) - expected) < 1e-6);
      s += length;
    }
    if (interval.near_m < far_m) {
      CHECK(s == Approx(far_m).margin(1e-6));
    } else {
      CHECK(batch.n_segments() == 0);
    }
  }
}

TEST_CASE("a batch stays in compressed-row form, empty rays included") {
  const RayGrid grid = narrow_grid(acquisition(35, 70, 1e4));
  SampleBatch batch;
  begin_ray(batch, grid, 0, 1);
  append_segments(batch, grid, 0.0, 1, {-1.5, -1.2});  // exactly bin 0
  append_segments(batch, grid, 0.0, 1, {-0.9, -0.3});  // bins 2 and 3
  begin_ray(batch, grid, 1, 2);
  append_segments(batch, grid, 0.0, 2, {1.5, 2.0});  // beyond the last bin
  begin_ray(batch, grid, 2, 3);
  append_segments(batch, grid, 0.0, 3, {1.1, 7.0});  // cut off there
  CHECK(batch.n_rays() == 3);
  CHECK(batch.ray_row == std::vector<std::uint32_t>{0, 1, 2});
  CHECK(batch.ray_elevation == std::vector<std::uint32_t>{1, 2, 3});
  CHECK(batch.ray_begin.front() == 0);
  CHECK(batch.ray_begin.back() == batch.n_segments());
  CHECK(batch.ray_begin[1] == batch.ray_begin[2]);
  CHECK(batch.bin.back() == 9);
  CHECK(glm::length(glm::dvec3(batch.ray_direction[2]) - grid.direction(3)) < 1e-7);
  const SegmentSpans<float> view = spans(batch);
  CHECK(view.ray_begin.size() == 4);
  CHECK(view.length_m.size() == batch.n_segments());
  batch.clear();
  CHECK((batch.n_rays() == 0 && batch.n_segments() == 0 && batch.ray_begin.size() == 1));
}
