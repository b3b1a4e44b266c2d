// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

using namespace sarnerf;

namespace {

constexpr Colour kWhite = {255, 255, 255};

/// Outward triangles of a box.
SurfaceMesh block(const glm::dvec3& min_m, const glm::dvec3& max_m) {
  SurfaceMesh mesh;
  for (int n = 0; n < 8; ++n)
    mesh.vertices_m.emplace_back(n & 1 ? max_m.x : min_m.x, n & 2 ? max_m.y : min_m.y, n & 4 ? max_m.z : min_m.z);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// Blue as facets are, seen from the front: greys of labels and the colours of axes are not.
bool is_surface(const Colour& c) { return c[2] > c[1] && c[1] > c[0] && c[2] - c[0] > 15 && c[1] - c[0] > 8; }

int n_surface(const Image<Colour>& picture, int top, int left, int height, int width) {
  int n = 0;
  for (int i = top; i < top + height; ++i)
    for (int j = left; j < left + width; ++j) n += is_surface(picture(i, j)) ? 1 : 0;
  return n;
}

}  // namespace

TEST_CASE("an empty surface gives a white picture") {
  const Image<Colour> picture = preview({});
  CHECK(picture.n_azimuth() == 900);
  CHECK(picture.n_range() == 1200);
  CHECK(std::all_of(picture.pixels().begin(), picture.pixels().end(), [](const Colour& c) { return c == kWhite; }));
  SurfaceMesh point;
  point.vertices_m = {glm::dvec3(1.0)};
  point.triangles = {{0, 0, 0}};
  CHECK_NOTHROW(preview(point));
}

TEST_CASE("the three views show a box at one scale") {
  const Image<Colour> picture = preview(block({1000.0, 20.0, -3000.0}, {1008.0, 23.0, -2995.0}));
  // Frames of 360 × 300 pixels at the right; areas of 8 × 5, 8 × 3 and 5 × 3 m.
  const double above = n_surface(picture, 0, 840, 300, 360), front = n_surface(picture, 300, 840, 300, 360),
               side = n_surface(picture, 600, 840, 300, 360);
  REQUIRE(side > 1000);
  CHECK(above / side == Approx(40.0 / 15.0).epsilon(0.02));
  CHECK(front / side == Approx(24.0 / 15.0).epsilon(0.02));
  CHECK(n_surface(picture, 0, 0, 900, 840) > 0.1 * 900 * 840);
}

TEST_CASE("views look from where their names say") {
  // A low plate with a tower on its corner at +X and −Z.
  SurfaceMesh mesh = block({-5.0, 0.0, -5.0}, {5.0, 1.0, 5.0});
  const SurfaceMesh tower = block({3.0, 1.0, -5.0}, {5.0, 9.0, -3.0});
  for (const glm::uvec3& t : tower.triangles) mesh.triangles.push_back(t + 8u);
  mesh.vertices_m.insert(mesh.vertices_m.end(), tower.vertices_m.begin(), tower.vertices_m.end());
  const Image<Colour> picture = preview(mesh);
  const auto right_of_middle = [&](int top) {
    return n_surface(picture, top, 1020, 300, 180) > n_surface(picture, top, 840, 300, 180) + 500;
  };
  CHECK(right_of_middle(300));  // from +Z: +X is at the right
  CHECK(right_of_middle(600));  // from +X: −Z is at the right
  // From above the plate is farther, and paler, than the tower at the upper right.
  const Colour plate = picture(150, 1020), top = picture(150 - 85, 1020 + 85);
  CHECK(is_surface(plate));
  CHECK(is_surface(top));
  CHECK(plate[0] > top[0]);
  // Up is up: nothing but the tower in the upper half of the front view.
  CHECK(n_surface(picture, 300, 840, 150, 180) == 0);
}

TEST_CASE("what is seen from behind is red") {
  SurfaceMesh mesh = block({0.0, 0.0, 0.0}, {4.0, 4.0, 4.0});
  for (glm::uvec3& t : mesh.triangles) std::swap(t.x, t.y);
  const Image<Colour> picture = preview(mesh);
  const Colour middle = picture(450, 1020);
  CHECK(middle[0] > middle[2] + 40);
}

TEST_CASE("sizes and angles of previews are as asked") {
  const SurfaceMesh mesh = block({0.0, 0.0, 0.0}, {0.001, 0.002, 0.001});
  PreviewOptions options;
  options.width = 333;
  options.height = 201;
  const Image<Colour> picture = preview(mesh, options);
  CHECK(picture.n_azimuth() == 201);
  CHECK(picture.n_range() == 333);
  options.azimuth_rad += 1.0;
  options.elevation_rad = 1.5707963267948966;
  const Image<Colour> other = preview(mesh, options);
  CHECK_FALSE(std::equal(picture.pixels().begin(), picture.pixels().end(), other.pixels().begin()));
  options.width = 10;
  CHECK_THROWS_AS(preview(mesh, options), UsageError);
  options.width = 100000;
  CHECK_THROWS_AS(preview(mesh, options), UsageError);
  options.width = 400;
  options.azimuth_rad = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(preview(mesh, options), UsageError);
}

TEST_CASE("previews do not depend on the number of threads") {
  const SurfaceMesh mesh = block({0.0, 0.0, 0.0}, {3.0, 2.0, 1.0});
  const Image<Colour> picture = preview(mesh);
  const ThreadLimit one(1);
  const Image<Colour> alone = preview(mesh);
  CHECK(std::equal(picture.pixels().begin(), picture.pixels().end(), alone.pixels().begin()));
  CHECK_FALSE(encode_png(picture).empty());
}
