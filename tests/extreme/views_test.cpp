// SPDX-License-Identifier: Apache-2.0
// Whole images of planes from 100 m to geostationary range, from next to nadir to next to the horizon.
#include <random>

#include "catch.h"
#include "extreme_scenes.h"
#include "matrix.h"
#include "quad_geometry.h"
#include "plan.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kPitches_deg[] = {0.5, 3.0, 20.0, 45.0, 70.0, 87.0, 89.5};
constexpr double kSpacings_m[] = {1e-3, 0.3, 5.0, 100.0};
constexpr int kBins = 24;

/// Calls check(view) for every range, pitch and spacing whose image does not reach behind the radar.
template <class Check>
void for_each_view(Check&& check) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> turn(0.0, 2.0 * kPi);
  for (const double range_m : kRanges_m) {
    for (const double pitch : kPitches_deg) {
      for (const double spacing_m : kSpacings_m) {
        Acquisition a = extreme_view(range_m, pitch, spacing_m, 3, 48);
        if (a.range_m(-0.5) <= 0.0) continue;
        a.azimuth_rad = turn(random);
        a.aim_m = {500123.25, 80.5, -4000321.75};
        check(a);
      }
    }
  }
}

}  // namespace

TEST_CASE("origins and directions of traced rays, at every range", "[geometry]") {
  std::mt19937 random(25);
  for (const double range_m : kRanges_m) {
    for (int trial = 0; trial < 40; ++trial) {
      Acquisition a = extreme_acquisition(random, range_m);
      a.n_azimuth = 64;
      a.azimuth_spacing_m = a.range_spacing_m;
      const double half_m = std::min(100.0 * a.range_spacing_m, 0.3 * range_m);
      const glm::dvec3 centre = a.aim_m + 0.2 * half_m;
      const Box box{centre - 0.5 * half_m, centre + 0.5 * half_m};
      const VisibleExtent extent(a, box);
      const Fan fan = make_fan(angular_extent(a, box), 33);
      const ViewRays rays(a, fan, centre, extent.range_offsets_m());
      const QuadFrame frame(a);
      const QuadVector to_scene = quad_vector(a.aim_m) - quad_vector(centre);
      const float shift = static_cast<float>(a.row_offset_m(40.0));
      for (int k = 0; k < 33; k += 4) {
        const auto n = static_cast<std::size_t>(k);
        // What Embree is given, in float32, and a hit half-way into the box.
        const glm::dvec3 origin = glm::dvec3(rays.origin_x[n], rays.origin_y[n], rays.origin_z[n]) + double(shift) * rays.grid.frame().h;
        const float t = 0.5f * rays.far_m;
        const QuadVector found = quad_vector(glm::vec3(origin)) +
                                 Quad(t) * quad_vector(glm::vec3(rays.direction_x[n], rays.direction_y[n], rays.direction_z[n]));
        const QuadVector expected = quad_point(a, fan, frame, Quad(shift), Quad(rays.start_offset_m) + Quad(t), k) + to_scene;
        const double error = error_in_pixels(found - expected, frame, a);
        record(Case::ray_origins, error);
        INFO(text_of(a));
        CHECK(error < 1e-3);
      }
    }
  }
}

TEST_CASE("a level plane, at every range, pitch and spacing", "[geometry]") {
  int n_views = 0;
  for_each_view([&](const Acquisition& a) {
    const auto extent = roof_of_bins(a, kBins);
    if (!extent) return;
    ++n_views;
    INFO(text_of(a));
    const Image<float> image = render_surface(roof_scene(a, *extent), a);
    CHECK(sound(image));
    const double error = worst_error(image, KnownPlane::level(a, extent->height_m, -extent->half_m, extent->half_m));
    record(Case::roof, error);
    CHECK(error < 0.005);
  });
  CHECK(n_views > 80);
}

TEST_CASE("a wall, at every range, pitch and spacing", "[geometry]") {
  int n_views = 0;
  for_each_view([&](const Acquisition& a) {
    const auto extent = wall_of_bins(a, kBins);
    if (!extent) return;
    ++n_views;
    INFO(text_of(a));
    // Next to nadir a wall of many bins is narrower than the spacing of rays, a quarter of a pixel, and chance
    // decides whether one meets it: there --elevations has to ask for more.
    const Scene scene = wall_scene(a, *extent);
    const SurfaceEngine engine(scene);
    ViewPlan plan = engine.plan(a, {});
    const double across_rad = extent->height_m * std::sin(a.incidence_rad) / a.slant_range_m;
    if (across_rad < 16.0 * plan.fan.step_rad) {
      const double wanted = 16.0 * plan.fan.n_elevation * plan.fan.step_rad / across_rad;
      plan = engine.plan(a, {static_cast<int>(wanted), 0, Integrator::exact});
    }
    const Image<float> image = engine.render(plan).beta0;
    CHECK(sound(image));
    const double error = worst_error(image, KnownPlane::wall(a, 0.0, extent->height_m));
    record(Case::wall, error);
    CHECK(error < 0.005);
  });
  CHECK(n_views > 80);
}

TEST_CASE("the ground, at every range, pitch and spacing", "[geometry]") {
  for_each_view([&](const Acquisition& a) {
    INFO(text_of(a));
    Scene scene = empty_scene(matte());
    scene.ground = Ground{0, a.aim_m.y};
    const Image<float> image = render_surface(scene, a);
    CHECK(sound(image));
    const double most = 100.0 * a.slant_range_m;
    const KnownPlane plane = KnownPlane::level(a, 0.0, -a.slant_range_m * std::sin(a.incidence_rad), most);
    double worst = 0.0;
    for (int j = 0; j < a.n_range; ++j) {
      const double expected = plane.beta0(j);
      worst = worse(worst, std::abs(double(image(1, j)) - expected) / std::max(expected, 1e-3));
    }
    record(Case::ground, worst);
    CHECK(worst < 0.005);
  });
}
