// SPDX-License-Identifier: Apache-2.0
#include <cstring>

#include "catch.h"
#include "mirrored.h"
#include "sarnerf/core/parallel.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Scene village(double turn_rad, double s) {
  Scene scene = empty_scene(checkered(s));
  scene.materials.push_back(fog(0.3 / s, 0.1 / s));
  // The objects turn, and their textures with them.
  const double c = std::cos(turn_rad), n = std::sin(turn_rad);
  scene.objects[0].object_from_world =
      glm::dmat4(glm::dvec4(c, 0, n, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(-n, 0, c, 0),
                 glm::dvec4(0, 0, 0, 1));
  const auto turned = [&](double x, double z) {
    return s * glm::dvec3(c * x + n * z, 0.0, -n * x + c * z);
  };
  add_box(scene, s * glm::dvec3(7.0, 5.0, 4.0), turn_rad, turned(-1.0, 2.0));
  add_frustum(scene, s * glm::dvec2(3.0, 2.0), s * glm::dvec2(1.0, 1.0), s * 6.0, turn_rad,
              turned(4.0, -3.0));
  add_box(scene, s * glm::dvec3(3.0, 3.0, 2.0), turn_rad, turned(-2.0, 6.0), 1);
  return scene;
}

}  // namespace

TEST_CASE("turning scene and radar together changes nothing", "[invariance]") {
  Acquisition view = view_of(40.0, 1e4, 96, 96);
  view.azimuth_rad = 0.3;
  const Image<float> image = render(village(0.0, 1.0), view);
  CHECK(sum(image) > 100.0);
  for (const double turn : {0.7, 2.0, 4.4}) {
    Acquisition turned = view;
    turned.azimuth_rad += turn;
    CHECK(relative_l2(render(village(turn, 1.0), turned), image) < 1e-3);
  }
}

TEST_CASE("scaling scene, spacing, texture, media and range together changes nothing",
          "[invariance]") {
  Acquisition view = view_of(40.0, 1e4, 96, 96);
  view.azimuth_rad = 0.3;
  const Image<float> image = render(village(0.0, 1.0), view);
  for (const double s : {1e-3, 0.1, 8.0, 1000.0}) {
    Acquisition scaled = view;
    scaled.slant_range_m *= s;
    scaled.azimuth_spacing_m *= s;
    scaled.range_spacing_m *= s;
    INFO("scale " << s);
    CHECK(relative_l2(render(village(0.0, s), scaled), image) < 1e-3);
  }
}

TEST_CASE("moving scene and aim point together changes nothing", "[invariance]") {
  Acquisition view = view_of(40.0, 1e4, 96, 96);
  Scene near = empty_scene(matte(1.0)), utm = empty_scene(matte(1.0));
  const glm::dvec3 where(512345.0, 120.0, -5412345.0);
  add_box(near, {7.0, 5.0, 4.0}, 0.4);
  add_box(utm, {7.0, 5.0, 4.0}, 0.4, where);
  const Image<float> image = render(near, view);
  view.aim_m = where;
  CHECK(relative_l2(render(utm, view), image) < 1e-4);
}

TEST_CASE("a left-looking image is the mirror image of a mirrored scene", "[invariance]") {
  Scene scene = empty_scene(matte(1.0));
  add_box(scene, {7.0, 5.0, 4.0}, 0.4, {2.0, 0.0, 1.0});
  Acquisition view = view_of(40.0, 1e4, 96, 96);
  const Image<float> right = render(scene, view);
  view.look = Look::left;
  const Image<float> left = render(scene, view);
  CHECK(relative_l2(rows_reversed(left), right) < 1e-4);
}

TEST_CASE("the same bytes whatever the number of threads", "[invariance]") {
  Scene scene = village(0.3, 1.0);
  scene.ground = Ground{0, 0.0};
  const Acquisition view = view_of(40.0, 1e4, 96, 96);
  const SurfaceEngine engine(scene);
  Image<float> first;
  for (const int n : {1, 2, 5}) {
    const ThreadLimit limit(n);
    const Image<float> image = engine.render(engine.plan(view, {})).beta0;
    if (n == 1) first = image;
    CHECK(std::memcmp(image.pixels().data(), first.pixels().data(), image.pixels().size_bytes()) == 0);
  }
}

TEST_CASE("brightness is linear in gamma0 and unaffected by unlit matter", "[invariance]") {
  Scene one = empty_scene(matte(1.0, 1.0)), three = empty_scene(matte(1.0, 3.0));
  for (Scene* scene : {&one, &three}) add_box(*scene, {7.0, 5.0, 4.0}, 0.4);
  const Acquisition view = view_of(40.0, 1e4, 64, 64);
  Image<float> tripled = render(one, view);
  for (float& p : tripled.pixels()) p *= 3.0f;
  CHECK(relative_l2(render(three, view), tripled) < 1e-6);
}
