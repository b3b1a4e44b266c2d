// SPDX-License-Identifier: Apache-2.0
// Meshes in far places, of odd sizes and of bad shapes: their images are those of the same solid drawn well.
#include "catch.h"
#include "extreme_meshes.h"
#include "matrix.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Of the surface engine where the same solid is drawn with other triangles: outlines between rays are found on
/// the triangle that a ray met, and guessed where it is smaller than the spacing of rays.
constexpr double kOtherTriangles = 3e-3;

void check(Case row, const Differences& d, double surface, double voxels) {
  record(row, std::max(d.surface, d.voxels));
  INFO("surface " << d.surface << ", voxels " << d.voxels);
  CHECK(d.surface < surface);
  CHECK(d.voxels < voxels);
}

const BothImages& reference() {
  static const BothImages images = both_images(two_boxes(in_place), mesh_view());
  return images;
}

}  // namespace

TEST_CASE("map coordinates", "[meshes]") {
  const glm::dvec3 where(512345.25, 120.5, -4123456.75);
  const BothImages found = both_images(two_boxes([&](const glm::dvec3& p) { return p + where; }), mesh_view(where));
  check(Case::map_coordinates, differences(found, reference()), 1e-4, 1e-4);
}

TEST_CASE("models of 1 mm and of 100 km", "[meshes]") {
  for (const double scale : {1e-4, 1e4}) {
    INFO("scale " << scale);
    const BothImages found = both_images(two_boxes([&](const glm::dvec3& p) { return scale * p; }),
                                         mesh_view(glm::dvec3(0.0), scale), scale * kMeshVoxel_m);
    check(Case::sizes, differences(found, reference()), 1e-4, 1e-3);
  }
}

TEST_CASE("models of 1 mm and of 100 km on a ground with floors in its plane", "[meshes]") {
  const auto image = [](double scale) {
    ObjBuilder obj;
    const Place place = [&](const glm::dvec3& p) { return scale * p; };
    add_turned_box(obj, {-2.0, 0.0, -2.0}, {4.0, 3.0, 4.0}, place);
    // A yard in the ground's plane, which the mesh wins, and a cellar below it, which nobody sees.
    const int first = obj.vertex(place({-6.0, 0.0, 3.0}));
    obj.vertex(place({6.0, 0.0, 3.0}));
    obj.vertex(place({6.0, 0.0, 8.0}));
    obj.vertex(place({-6.0, 0.0, 8.0}));
    obj.triangle(first, first + 2, first + 1);
    obj.triangle(first, first + 3, first + 2);
    add_turned_box(obj, {-3.0, -2.0, -7.0}, {6.0, 1.5, 3.0}, place);
    Scene scene = load_text("mesh.obj", obj.text());
    Material dark = matte(1.0, 0.05);
    scene.materials.push_back(dark);
    scene.ground = Ground{static_cast<std::uint32_t>(scene.materials.size()) - 1, 0.0};
    return render_surface(scene, mesh_view(glm::dvec3(0.0), scale));
  };
  const Image<float> expected = image(1.0);
  for (const double scale : {1e-4, 1e4}) {
    INFO("scale " << scale);
    const double error = relative_l2(image(scale), expected);
    record(Case::sizes, error);
    CHECK(error < 1e-3);
  }
}

TEST_CASE("slivers of aspect 1e8 within faces", "[meshes]") {
  // The walls of a box in courses, of which every other one is 1e-7 m high and up to 10 m long.
  ObjBuilder obj;
  const glm::dvec3 min(-5.0, 0.0, -4.0), size(10.0, 6.0, 8.0);
  const double heights_m[] = {0.0, 1e-7, 2.0, 2.0 + 1e-7, 4.0, 4.0 + 1e-7, 6.0};
  int n_rings = 0;
  for (const double height_m : heights_m) {
    for (int n = 0; n < 4; ++n) {
      glm::dvec3 corner = turned_corner(n, min, size);
      corner.y = height_m;
      obj.vertex(corner);
    }
    ++n_rings;
  }
  for (int ring = 0; ring + 1 < n_rings; ++ring) {
    for (int n = 0; n < 4; ++n) {
      const int low = 4 * ring + n + 1, next = 4 * ring + (n + 1) % 4 + 1;
      obj.triangle(low, low + 4, next);
      obj.triangle(next, low + 4, next + 4);
    }
  }
  const int top = 4 * (n_rings - 1) + 1;
  obj.triangle(1, 2, 3);
  obj.triangle(1, 3, 4);
  obj.triangle(top, top + 2, top + 1);
  obj.triangle(top, top + 3, top + 2);
  ObjBuilder plain;
  add_turned_box(plain, min, size, in_place);
  const BothImages found = both_images(obj.text(), mesh_view());
  check(Case::slivers, differences(found, both_images(plain.text(), mesh_view())), kOtherTriangles, 1e-3);
}

TEST_CASE("a lone sliver of aspect 1e8 gives next to nothing", "[meshes]") {
  ObjBuilder obj;
  obj.vertex({-50.0, 0.0, 0.0});
  obj.vertex({50.0, 0.0, 0.0});
  obj.vertex({50.0, 1e-6, 0.0});
  obj.triangle(1, 2, 3);
  const Scene scene = load_text("mesh.obj", obj.text());
  const Image<float> image = render_surface(scene, mesh_view());
  double largest = 0.0;
  for (const float p : image.pixels()) {
    CHECK((std::isfinite(p) && p >= 0.0f));
    largest = std::max(largest, double(p));
  }
  // Its area over a pixel's: 1e-6 m by 0.3 m over 0.09 m² times tan 40°.
  record(Case::slivers, largest);
  CHECK(largest < 1e-5);
}

TEST_CASE("coincident faces", "[meshes]") {
  ObjBuilder whole, stacked, twice;
  const glm::dvec3 min(-5.0, 0.0, -4.0);
  add_turned_box(whole, min, {10.0, 6.0, 8.0}, in_place);
  add_turned_box(stacked, min, {10.0, 2.0, 8.0}, in_place);
  add_turned_box(stacked, min + glm::dvec3(0.0, 2.0, 0.0), {10.0, 4.0, 8.0}, in_place);
  for (int n = 0; n < 3; ++n) add_turned_box(twice, min, {10.0, 6.0, 8.0}, in_place, n == 1);
  const BothImages expected = both_images(whole.text(), mesh_view());
  check(Case::coincident, differences(both_images(stacked.text(), mesh_view()), expected), kOtherTriangles, 1e-3);
  check(Case::coincident, differences(both_images(twice.text(), mesh_view()), expected), 1e-4, 1e-4);
}

TEST_CASE("nested and intersecting solids", "[meshes]") {
  ObjBuilder whole, nested, crossing;
  const glm::dvec3 min(-5.0, 0.0, -4.0);
  add_turned_box(whole, min, {10.0, 6.0, 8.0}, in_place);
  add_turned_box(nested, min, {10.0, 6.0, 8.0}, in_place);
  add_turned_box(nested, min + 1.0, {8.0, 4.0, 6.0}, in_place);
  add_turned_box(nested, min + 2.0, {6.0, 2.0, 4.0}, in_place, true);
  add_turned_box(crossing, min, {7.0, 6.0, 8.0}, in_place);
  add_turned_box(crossing, min + glm::dvec3(3.0, 0.0, 0.0), {7.0, 6.0, 8.0}, in_place);
  const BothImages expected = both_images(whole.text(), mesh_view());
  check(Case::nested, differences(both_images(nested.text(), mesh_view()), expected), kOtherTriangles, 1e-3);
  check(Case::nested, differences(both_images(crossing.text(), mesh_view()), expected), kOtherTriangles, 1e-2);
}

TEST_CASE("solids inside out, and faces of either sense at random", "[meshes]") {
  check(Case::inside_out, differences(both_images(two_boxes(in_place, true), mesh_view()), reference()), 1e-5, 1e-3);
  ObjBuilder mixed;
  for (const auto& [min, size] : {std::pair{glm::dvec3(-4.0, 0.0, -3.0), glm::dvec3(8.0, 5.0, 6.0)},
                                  std::pair{glm::dvec3(4.5, 0.0, -2.0), glm::dvec3(2.0, 8.0, 2.0)}}) {
    int first = 0;
    for (int n = 0; n < 8; ++n) {
      const int number = mixed.vertex(turned_corner(n, min, size));
      if (n == 0) first = number;
    }
    int n = 0;
    for (const auto& f : kCubeFaces) {
      const bool turned = (n++ * 7) % 3 == 0;
      mixed.triangle(first + f[0], first + f[turned ? 2 : 1], first + f[turned ? 1 : 2]);
    }
  }
  check(Case::inside_out, differences(both_images(mixed.text(), mesh_view()), reference()), 1e-5, 1e-3);
}

TEST_CASE("slabs and sheets thinner than a voxel hide what is behind them", "[meshes]") {
  // A wall of 6 m, from a sheet without thickness to one of two voxels.
  Image<float> first;
  for (const double thickness_m : {0.0, 1e-6, 0.003, 0.1, 0.6}) {
    INFO("thickness " << thickness_m << " m");
    Scene scene = empty_scene(matte());
    Acquisition view = view_of(40.0, 1e5, 16, 128);
    if (thickness_m > 0.0) {
      add_box(scene, {24.0, 6.0, thickness_m}, 0.0, {0.0, 0.0, -0.5 * thickness_m});
    } else {
      add_sheet(scene, {-12.0, 0.0, 0.0}, {24.0, 0.0, 0.0}, {0.0, 6.0, 0.0});
    }
    scene.ground = Ground{0, 0.0};
    const Image<float> image = render_voxels(scene, view, 0.3);
    const double theta = view.incidence_rad;
    // Layover of wall and ground from −h cos θ to 0, then shadow to h tan θ sin θ.
    const double tip = -6.0 * std::cos(theta), end = 6.0 * std::tan(theta) * std::sin(theta);
    for (int j = 0; j < view.n_range; ++j) {
      const double near_m = view.bin_offset_m(j - 0.5), far_m = view.bin_offset_m(j + 0.5);
      const double ground = 1.0 / std::tan(theta), margin_m = 1.2;
      double expected = ground;
      if (near_m > tip + margin_m && far_m < -margin_m) {
        expected += std::tan(theta);
      } else if (near_m > margin_m && far_m < end - margin_m) {
        expected = 0.0;
      } else if (!(far_m < tip - margin_m || near_m > end + margin_m)) {
        continue;
      }
      const double error = std::abs(double(image(8, j)) - expected) / std::max(expected, 1.0);
      record(Case::thin, error);
      CHECK(error < 0.03);
    }
  }
}
