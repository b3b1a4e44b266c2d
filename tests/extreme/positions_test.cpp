// SPDX-License-Identifier: Apache-2.0
// Where samples lie, from 100 m to geostationary range, against quadruple precision.
#include "../mpa/dense_segments.h"
#include "catch.h"
#include "matrix.h"
#include "quad_geometry.h"
#include "sarnerf/mpa/volume_march.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr int kTrials = 40;

/// Rays over a scene of some hundred pixels about the aim point, as far as the radar can see it.
Fan fan_over_scene(const Acquisition& a) {
  const double half_m = std::min(200.0 * std::min(a.range_spacing_m, a.azimuth_spacing_m), 0.5 * a.slant_range_m);
  const double half_rad = std::atan(half_m / a.slant_range_m);
  return make_fan({-half_rad, 0.7 * half_rad}, 37);
}

}  // namespace

TEST_CASE("sample positions in double, at every range", "[core]") {
  std::mt19937 random(21);
  for (const double range_m : kRanges_m) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const Acquisition a = extreme_acquisition(random, range_m);
      CHECK_NOTHROW(validate(a));
      const RayGrid grid(a, fan_over_scene(a));
      const QuadFrame frame(a);
      for (int k = 0; k < grid.fan().n_elevation; k += 6) {
        for (const int i : {0, 1000, 2047, 4095}) {
          for (const int j : {0, a.n_range / 2, a.n_range - 1}) {
            // The definitions, in quadruple precision as well.
            const Quad along = (Quad(i) - Quad(a.n_azimuth - 1) / 2) * Quad(a.azimuth_spacing_m);
            const Quad offset = (Quad(j) - Quad(a.n_range - 1) / 2) * Quad(a.range_spacing_m);
            const glm::dvec3 found = grid.point_from_aim_m(a.row_offset_m(i), a.bin_offset_m(j), k);
            const QuadVector expected = quad_point(a, grid.fan(), frame, along, offset, k);
            const double error = error_in_pixels(quad_vector(found) - expected, frame, a);
            record(Case::positions, error);
            INFO("range " << range_m << " m, spacing " << a.azimuth_spacing_m << " x " << a.range_spacing_m);
            CHECK(error < 1e-3);
          }
        }
      }
    }
  }
}

TEST_CASE("points of segments in float32, at every range", "[core]") {
  std::mt19937 random(22);
  for (const double range_m : kRanges_m) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const Acquisition a = extreme_acquisition(random, range_m);
      const RayGrid grid(a, fan_over_scene(a));
      const QuadFrame frame(a);
      SampleBatch batch;
      // Float32 holds points as far as 8,000 of the finer spacings from the aim point to a thousandth of it.
      const double finer_m = std::min(a.azimuth_spacing_m, a.range_spacing_m);
      const double along_m = std::min(2000.5 * a.azimuth_spacing_m, 7000.0 * finer_m);
      const double half_m = std::min(0.5 * a.n_range * a.range_spacing_m, 3000.0 * finer_m);
      for (int k = 0; k < grid.fan().n_elevation; k += 9) {
        begin_ray(batch, grid, 0, k);
        append_segments(batch, grid, along_m, k, {-half_m, half_m});
        Quad near = -half_m;
        for (std::size_t s = batch.ray_begin[batch.n_rays() - 1]; s < batch.n_segments(); ++s) {
          // Segments follow one another: the middle of each is known from the lengths before.
          const Quad border = (Quad(batch.bin[s]) + 1 - Quad(a.n_range) / 2) * Quad(a.range_spacing_m);
          const Quad far = border < Quad(half_m) ? border : Quad(half_m);
          const QuadVector expected = quad_point(a, grid.fan(), frame, along_m, (near + far) / 2, k);
          const double error = error_in_pixels(quad_vector(batch.point_m[s]) - expected, frame, a);
          record(Case::segment_points, error);
          INFO("range " << range_m << " m, spacing " << a.azimuth_spacing_m << " x " << a.range_spacing_m);
          CHECK(error < 1e-3);
          CHECK(std::abs(as_double((far - near - Quad(batch.length_m[s])) / Quad(a.range_spacing_m))) < 1e-6);
          near = far;
        }
        CHECK(as_double(near) == Approx(half_m).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("world points project to range, row and ray, at every range", "[core]") {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> symmetric(-1.0, 1.0);
  for (const double range_m : kRanges_m) {
    for (int trial = 0; trial < 200; ++trial) {
      Acquisition a = extreme_acquisition(random, range_m);
      a.aim_m = glm::dvec3(0.0);  // its own rounding in map coordinates is not the projection's
      const double half_m = std::min(100.0 * a.range_spacing_m, 0.4 * range_m);
      const glm::dvec3 point(half_m * symmetric(random), half_m * symmetric(random), half_m * symmetric(random));
      const RadarPoint found = project(a, radar_frame(a), point);
      const QuadFrame frame(a);
      const QuadVector from_radar = quad_vector(point) - frame.radar;
      const Quad v = dot(from_radar, frame.v), k = dot(from_radar, frame.k);
      const Quad range = quad_sqrt(v * v + k * k);
      const double range_error = as_double(range - Quad(range_m) - Quad(found.range_offset_m)) / a.range_spacing_m;
      const double angle_error = as_double((quad_atan2(v, k) - Quad(found.ray_angle_rad)) * range) / a.range_spacing_m;
      record(Case::projection, std::hypot(range_error, angle_error));
      INFO("range " << range_m << " m, spacing " << a.range_spacing_m);
      CHECK(std::abs(range_error) < 1e-3);
      CHECK(std::abs(angle_error) < 1e-3);
    }
  }
}

TEST_CASE("the ground's angles at the borders of the swath, at every range", "[core]") {
  std::mt19937 random(24);
  for (const double range_m : kRanges_m) {
    for (int trial = 0; trial < 200; ++trial) {
      Acquisition a = extreme_acquisition(random, range_m);
      a.aim_m = {0.0, 0.0, 0.0};
      const auto angles = ground_angular_extent(a, 0.0);
      REQUIRE(angles);
      const Quad height = Quad(range_m) * quad_cos(Quad(a.incidence_rad));
      for (const bool far : {false, true}) {
        const Quad half = Quad(a.n_range) / 2 * Quad(a.range_spacing_m);
        const Quad range = Quad(range_m) + (far ? half : -half);
        const Quad angle = range > height ? quad_acos(height / range) - Quad(a.incidence_rad) : -Quad(a.incidence_rad);
        const double found = far ? angles->second : angles->first;
        // On the ground, ranges turn into angles by r tan θ; what counts is the range that the angle stands for.
        const Quad seen = height / quad_cos(Quad(found) + Quad(a.incidence_rad));
        const Quad exact = height / quad_cos(angle + Quad(a.incidence_rad));
        const double error = as_double(seen - exact) / a.range_spacing_m;
        record(Case::ground_angles, error);
        INFO("range " << range_m << " m, spacing " << a.range_spacing_m << ", incidence " << deg_from_rad(a.incidence_rad));
        CHECK(std::abs(error) < 1e-3);
      }
    }
  }
}
