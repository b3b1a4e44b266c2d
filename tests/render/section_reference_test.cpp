// SPDX-License-Identifier: Apache-2.0
// The double-precision reference against paper, identities and the surface engine.
#include "reference/section_reference.h"

#include <functional>
#include <random>

#include "catch.h"
#include "mirrored.h"
#include "sarnerf/core/error.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kPitches_deg[] = {20.0, 35.0, 45.0, 55.0, 70.0};
constexpr double kAltitudes_m[] = {1e3, 1e4, 7e5};

/// ∫ cos^p from 0.
double cosine_integral(int p, double angle) {
  return p == 0 ? angle : p == 1 ? std::sin(angle) : 0.5 * angle + 0.25 * std::sin(2.0 * angle);
}

/// β⁰ of a face that is alone in its bins and of γ = cos^p of the angle from its normal, which is `angle_at` a
/// range: exact, not its value at the bin's centre.
double beta0_of_bin(const Acquisition& view, int j, int p, const std::function<double(double)>& angle_at) {
  const double near = cosine_integral(p, angle_at(view.range_m(j - 0.5)));
  const double far = cosine_integral(p, angle_at(view.range_m(j + 0.5)));
  return std::abs(far - near) * view.range_m(j) / view.range_spacing_m;
}

/// Angle (rad) that a row's rays spend on what they see, when its γ is 1.
double angle_of_row(const Image<float>& image, const Acquisition& view, int i) {
  double total = 0.0;
  for (int j = 0; j < view.n_range; ++j) total += image(i, j) * view.range_spacing_m / view.range_m(j);
  return total;
}

/// The bins that hold what a sheet of rays between two offsets covers wholly.
template <class F>
int for_inner_bins(const Acquisition& view, double near_m, double far_m, F&& f) {
  int n = 0;
  for (int j = 0; j < view.n_range; ++j) {
    if (view.bin_offset_m(j - 0.5) < near_m || view.bin_offset_m(j + 0.5) > far_m) continue;
    f(j);
    ++n;
  }
  return n;
}

double offset_m(const Acquisition& view, double y, double z) {
  return project(view, radar_frame(view), {0.0, y, z}).range_offset_m;
}

/// The engine with 8 times its automatic rays and the reference's slices.
Image<float> dense(const Scene& scene, const Acquisition& view, int n_slices) {
  const SurfaceEngine engine(scene);
  Sampling sampling;
  sampling.n_elevation = 8 * engine.plan(view, {}).fan.n_elevation;
  sampling.n_slices = n_slices;
  ViewPlan plan = engine.plan(view, sampling);
  plan.error.estimate = false;
  return engine.render(plan).beta0;
}

}  // namespace

TEST_CASE("reference: ground, roof and wall have their closed forms in every bin", "[reference]") {
  for (const double pitch : kPitches_deg) {
    for (const double altitude : kAltitudes_m) {
      for (const int p : {0, 1, 2}) {
        INFO("pitch " << pitch << " altitude " << altitude << " exponent " << p);
        const Acquisition view = view_of(pitch, altitude, 2, 96);
        const double height = view.altitude_m();
        const double distance = view.slant_range_m * std::sin(view.incidence_rad);

        Scene ground = empty_scene(matte(p));
        ground.ground = Ground{0, 0.0};
        const Image<float> of_ground = section_reference(ground, view, 2);
        for (int j = 0; j < view.n_range; ++j) {
          CHECK(of_ground(1, j) == Approx(beta0_of_bin(view, j, p, [&](double t) {
                                     return std::acos(height / t);
                                   })).epsilon(1e-6));
        }

        const double up = 6.0, half = 7.0;
        Scene roof = empty_scene(matte(p));
        add_sheet(roof, {-20.0, up, half}, {40.0, 0.0, 0.0}, {0.0, 0.0, -2.0 * half});
        const Image<float> of_roof = section_reference(roof, view, 2);
        int n = for_inner_bins(view, offset_m(view, up, half), offset_m(view, up, -half), [&](int j) {
          CHECK(of_roof(1, j) == Approx(beta0_of_bin(view, j, p, [&](double t) {
                                   return std::acos((height - up) / t);
                                 })).epsilon(1e-6));
        });
        CHECK(n > 10);

        Scene wall = empty_scene(matte(p));
        add_sheet(wall, {-20.0, 0.0, 0.0}, {40.0, 0.0, 0.0}, {0.0, up, 0.0});
        const Image<float> of_wall = section_reference(wall, view, 2);
        n = for_inner_bins(view, offset_m(view, up, 0.0), 0.0, [&](int j) {
          CHECK(of_wall(1, j) == Approx(beta0_of_bin(view, j, p, [&](double t) {
                                   return std::acos(distance / t);
                                 })).epsilon(1e-6));
        });
        CHECK(n > 3);
      }
    }
  }
}

TEST_CASE("reference: a box sends back exactly what its front and roof catch", "[reference]") {
  for (const double pitch : kPitches_deg) {
    for (const double altitude : kAltitudes_m) {
      INFO("pitch " << pitch << " altitude " << altitude);
      const Acquisition view = view_of(pitch, altitude, 6, 160);
      const RadarFrame frame = radar_frame(view);
      const auto incidence = [&](double y, double z) {
        return view.incidence_rad + project(view, frame, {0.0, y, z}).ray_angle_rad;
      };
      const double foot = incidence(0.0, 3.0), edge = incidence(5.0, 3.0), back = incidence(5.0, -3.0);
      // Four rows long.
      Scene uniform = empty_scene(matte(0.0)), cosine = empty_scene(matte(1.0));
      for (Scene* scene : {&uniform, &cosine}) add_box(*scene, {4 * 0.3, 5.0, 6.0});
      const Image<float> of_uniform = section_reference(uniform, view, 4);
      const Image<float> of_cosine = section_reference(cosine, view, 4);
      for (int i = 0; i < 6; ++i) {
        const double lit = i >= 1 && i <= 4 ? 1.0 : 0.0;
        CHECK(angle_of_row(of_uniform, view, i) == Approx(lit * (back - foot)).epsilon(1e-6));
        const double expected = std::cos(foot) - std::cos(edge) + std::sin(back) - std::sin(edge);
        CHECK(angle_of_row(of_cosine, view, i) == Approx(lit * expected).epsilon(1e-6));
      }
    }
  }
}

TEST_CASE("reference: every ray of a row ends somewhere, whatever crosses whatever", "[reference]") {
  // Shells through each other and through the ground, all of brightness 1: what one hides it replaces.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-5.0, 5.0), step(-2.0, 2.0);
  Scene scene = empty_scene(matte(0.0));
  scene.ground = Ground{0, 0.0};
  const auto point = [&](auto& by) { return glm::dvec3(by(random), by(random), by(random)); };
  for (int n = 0; n < 120; ++n) {
    const glm::dvec3 p = point(place);
    add_piece(scene, {p, p + point(step), p + point(step)}, {{0, 1, 2}}, false);
  }
  const Acquisition view = view_of(45.0, 1e4, 16, 200, 0.3, 25.0);
  const auto extent = ground_angular_extent(view, 0.0);
  const Image<float> image = section_reference(scene, view, 8);
  for (int i = 0; i < view.n_azimuth; ++i) {
    CHECK(angle_of_row(image, view, i) == Approx(extent->second - extent->first).epsilon(1e-6));
  }
}

TEST_CASE("reference: faces in the ground's plane are seen, faces below it are not", "[reference]") {
  const Acquisition view = view_of(45.0, 1e4, 2, 64);
  for (const double height : {0.0, -0.5}) {
    Scene scene = empty_scene(matte(0.0, 1.0));
    scene.materials.push_back(matte(0.0, 0.1));
    scene.ground = Ground{1, 0.0};
    add_sheet(scene, {-20.0, height, 3.0}, {40.0, 0.0, 0.0}, {0.0, 0.0, -6.0});
    const Image<float> image = section_reference(scene, view, 2);
    const double gamma = height == 0.0 ? 1.0 : 0.1;
    CHECK(image(0, 32) == Approx(gamma * beta0_of_bin(view, 32, 0, [&](double t) {
                            return std::acos(view.altitude_m() / t);
                          })).epsilon(1e-6));
  }
}

TEST_CASE("reference: solids through each other look like their union", "[reference]") {
  for (const double azimuth : {0.0, 33.0, 200.0}) {
    const Acquisition view = view_of(40.0, 1e4, 48, 96, 0.3, azimuth);
    Scene crossing = empty_scene(matte(1.0)), joined = empty_scene(matte(1.0));
    for (Scene* scene : {&crossing, &joined}) add_box(*scene, {8.0, 5.0, 4.0});
    add_box(crossing, {2.0, 8.0, 2.0}, 0.0, {1.0, 0.5, 0.0});       // a tower through the roof
    add_box(joined, {2.0, 3.5, 2.0}, 0.0, {1.0, 5.0, 0.0});
    add_box(crossing, {1.5, 1.5, 10.0}, 0.0, {-2.0, 1.0, 0.0});     // a beam through front and back
    add_box(joined, {1.5, 1.5, 3.0}, 0.0, {-2.0, 1.0, 3.5});
    add_box(joined, {1.5, 1.5, 3.0}, 0.0, {-2.0, 1.0, -3.5});
    CHECK(relative_l2(section_reference(crossing, view, 16), section_reference(joined, view, 16)) < 1e-6);
  }
}

TEST_CASE("reference: a slice stands for its width", "[reference]") {
  // Planes whose range moves along track while their outlines stay at one ray angle: one slice is as good as many.
  const Acquisition view = view_of(45.0, 1e5, 8, 128);
  const RadarFrame frame = radar_frame(view);
  for (const double turn : {-0.8, 0.3, 0.8}) {
    INFO("turned by " << turn);
    Scene scene = empty_scene(matte(1.0));
    const glm::dvec3 along = std::cos(turn) * frame.h + std::sin(turn) * frame.k;
    add_sheet(scene, -30.0 * along - 2.5 * frame.v, 60.0 * along, 5.0 * frame.v + 2.0 * frame.k);
    CHECK(relative_l2(section_reference(scene, view, 1), section_reference(scene, view, 128)) < 1e-5);
  }
}

TEST_CASE("reference: looking left reverses the rows", "[reference]") {
  Scene scene = empty_scene(checkered(1.0));
  scene.ground = Ground{0, 0.0};
  add_box(scene, {6.0, 4.0, 3.0}, 0.4, {1.0, 0.0, 0.5});
  Acquisition view = view_of(45.0, 1e4, 32, 64, 0.3, 15.0);
  const Image<float> right = section_reference(scene, view, 8);
  view.look = Look::left;
  const Image<float> left = section_reference(scene, view, 8);
  CHECK(relative_l2(rows_reversed(left), right) < 1e-6);
  CHECK(relative_l2(left, right) > 0.1);
}

TEST_CASE("reference: scenes in map coordinates lose nothing", "[reference]") {
  const glm::dvec3 far(500'000.0, 120.0, -5'400'000.0);
  Scene here = empty_scene(checkered(1.0)), there = here;
  add_box(here, {6.0, 4.0, 3.0}, 0.4);
  add_box(there, {6.0, 4.0, 3.0}, 0.4, far);
  there.objects[0].object_from_world[3] = glm::dvec4(-far, 1.0);
  Acquisition view = view_of(45.0, 7e5, 32, 64, 0.3, 15.0);
  const Image<float> expected = section_reference(here, view, 8);
  view.aim_m = far;
  CHECK(relative_l2(section_reference(there, view, 8), expected) < 1e-6);
}

TEST_CASE("reference: media have their closed forms", "[reference][media]") {
  const Acquisition view = view_of(35.0, 1e5, 2, 128);
  SECTION("a thin box scatters P times its section") {
    Scene scene = empty_scene(fog(0.0, 0.01));
    add_box(scene, {20.0, 4.0, 6.0});
    const Image<float> image = section_reference(scene, view, 2);
    double total = 0.0;
    for (const float p : image.row(1)) total += p * view.range_spacing_m;
    CHECK(total == Approx(0.01 * 4.0 * 6.0).epsilon(1e-6));
  }
  SECTION("a wall behind a screen loses exp(-two-way depth), which both ways and all screens share") {
    const auto wall_behind = [](const std::vector<Material>& screens) {
      Scene scene = empty_scene(matte());
      add_sheet(scene, {-20.0, 0.0, 0.0}, {40.0, 0.0, 0.0}, {0.0, 5.0, 0.0});
      for (const Material& m : screens) {
        scene.materials.push_back(m);
        add_box(scene, {60.0, 40.0, 2.0}, 0.0, {0.0, -1.0, 4.0}, static_cast<std::uint32_t>(scene.materials.size() - 1));
      }
      return scene;
    };
    Material one_way = fog(0.3, 0.0);
    one_way.extinction_back_per_m = 0.1;
    const double distance = view.slant_range_m * std::sin(view.incidence_rad);
    const Image<float> clear = section_reference(wall_behind({}), view, 2);
    for (const Scene& scene : {wall_behind({fog(0.2, 0.0)}), wall_behind({one_way}),
                               wall_behind({fog(0.15, 0.0), fog(0.05, 0.0)})}) {
      const Image<float> image = section_reference(scene, view, 2);
      for_inner_bins(view, offset_m(view, 5.0, 0.0), 0.0, [&](int j) {
        const double path_m = 2.0 * view.range_m(j) / distance;
        CHECK(image(1, j) == Approx(clear(1, j) * std::exp(-0.4 * path_m)).epsilon(1e-5));
      });
    }
  }
  SECTION("a dense solid is an opaque one of gamma = P / two-way extinction") {
    Scene solid = empty_scene(fog(5000.0, 3000.0)), opaque = empty_scene(matte(0.0, 0.3));
    for (Scene* scene : {&solid, &opaque}) add_box(*scene, {0.6, 3.0, 4.0}, 0.0);
    CHECK(relative_l2(section_reference(solid, view, 8), section_reference(opaque, view, 8)) < 2e-3);
  }
  SECTION("opaque matter inside a medium ends the ray") {
    Scene open = empty_scene(fog(0.1, 0.05)), filled = open;
    filled.materials.push_back(matte(0.0, 0.0));
    add_box(open, {20.0, 4.0, 6.0});
    add_box(filled, {20.0, 4.0, 6.0});
    add_piece(filled, {{-20, 0, 0}, {20, 0, 0}, {20, 9, 0}, {-20, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}, false, 1);
    const Image<float> whole = section_reference(open, view, 2), cut = section_reference(filled, view, 2);
    const double at_back = offset_m(view, 0.0, 0.0);
    double near_whole = 0.0, near_cut = 0.0;
    for (int j = 0; j < view.n_range; ++j) {
      if (view.bin_offset_m(j - 0.5) > at_back) {
        CHECK(cut(1, j) == 0.0f);
      }
      // Nearer than the wall's top nothing is hidden.
      if (view.bin_offset_m(j + 0.5) < offset_m(view, 4.0, 0.0)) {
        near_whole += whole(1, j);
        near_cut += cut(1, j);
      }
    }
    CHECK(near_whole > 0.0);
    CHECK(near_cut == Approx(near_whole).epsilon(1e-6));
  }
}

TEST_CASE("reference and dense engine agree", "[reference][engine]") {
  constexpr int kSlices = 128;
  const auto compare = [](const Scene& scene, const Acquisition& view) {
    const double difference = relative_l2(dense(scene, view, kSlices), section_reference(scene, view, kSlices));
    INFO("relative L2 difference " << difference);
    CHECK(difference < 1e-3);
  };
  SECTION("a cuboid with a checker") {
    Scene scene = empty_scene(checkered(1.0));
    add_box(scene, {5.0, 5.0, 5.0}, 0.35);
    compare(scene, view_of(45.0, 1e4, 32, 48));
  }
  SECTION("a building on a checkered ground") {
    Scene scene = empty_scene(matte(1.0));
    scene.materials.push_back(checkered(0.7));
    scene.ground = Ground{1, 0.0};
    add_box(scene, {6.0, 4.0, 4.0}, 0.35);
    compare(scene, view_of(45.0, 1e4, 32, 64));
  }
  SECTION("a street: trees before a house on the ground") {
    Scene scene = empty_scene(matte(1.0));
    scene.materials.push_back(fog(0.2, 0.1));
    scene.ground = Ground{0, 0.0};
    add_box(scene, {5.0, 4.0, 3.0}, 0.35);
    add_frustum(scene, {0.5, 0.5}, {1.2, 0.8}, 3.0, 0.7, {1.0, 0.5, 3.0}, 1);
    add_frustum(scene, {0.5, 0.5}, {1.2, 0.8}, 3.0, 0.2, {0.5, 1.0, 3.5}, 1);
    compare(scene, view_of(45.0, 1e4, 20, 48, 0.3));
  }
  SECTION("shells and a solid through each other, looking left") {
    Scene scene = empty_scene(matte(1.0));
    add_box(scene, {4.0, 3.0, 4.0}, 0.5);
    add_sheet(scene, {-3.0, 0.5, 1.0}, {6.0, 1.0, 0.5}, {0.5, 2.0, -3.0});
    add_sheet(scene, {-1.0, 0.0, -3.0}, {1.0, 4.0, 0.5}, {2.0, 0.5, 5.0});
    Acquisition view = view_of(60.0, 2e3, 32, 48, 0.3, 130.0);
    view.look = Look::left;
    compare(scene, view);
  }
}

TEST_CASE("reference: more slices differ less", "[reference]") {
  Scene scene = empty_scene(checkered(1.0));
  add_box(scene, {5.0, 5.0, 5.0}, 0.35);
  const Acquisition view = view_of(45.0, 1e4, 32, 48);
  std::vector<Image<float>> images;
  for (const int n : {4, 16, 64, 256}) images.push_back(section_reference(scene, view, n));
  const double coarse = relative_l2(images[0], images[1]), middle = relative_l2(images[1], images[2]),
               fine = relative_l2(images[2], images[3]);
  // At least first order in their number, where outlines fall between slices.
  CHECK(middle < 0.5 * coarse);
  CHECK(fine < 0.5 * middle);
  CHECK(fine < 2e-3);
}

TEST_CASE("reference: what has no image is refused", "[reference]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {5.0, 5.0, 5.0});
  CHECK_THROWS_AS(section_reference(scene, view_of(45.0), 0), UsageError);
  CHECK_THROWS_AS(section_reference(scene, view_of(45.0, 1.0, 8, 8, 0.01), 1), GeometryError);
  Acquisition buried = view_of(45.0, 100.0);
  scene.ground = Ground{0, 200.0};
  CHECK_THROWS_AS(section_reference(scene, buried, 1), GeometryError);
}
