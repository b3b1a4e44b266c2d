// SPDX-License-Identifier: Apache-2.0
// The image once more from first principles: rays from the radar itself, in long double, met with
// every triangle by the textbook formula, no acceleration, no reconstruction. Shares no code with the
// engine but the mesh.
#include <random>

#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

using Real = long double;
struct Vec {
  Real x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(Real s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
Real dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec vec(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

/// Ray parameter at a triangle seen from its front, or infinity.
Real hit(const Vec& origin, const Vec& d, const Vec& a, const Vec& b, const Vec& c, Real& cosine) {
  const Vec normal = cross(b - a, c - a);
  const Real along = dot(normal, d);
  if (along >= 0) return std::numeric_limits<Real>::infinity();
  const Real t = dot(normal, a - origin) / along;
  const Vec p = origin + t * d;
  if (dot(cross(b - a, p - a), normal) < 0 || dot(cross(c - b, p - b), normal) < 0 ||
      dot(cross(a - c, p - c), normal) < 0) {
    return std::numeric_limits<Real>::infinity();
  }
  cosine = -along / std::sqrt(dot(normal, normal));
  return t;
}

Image<float> independent_image(const Scene& scene, const Acquisition& a, bool mirrored) {
  const Real phi = a.azimuth_rad, theta = a.incidence_rad, r = a.slant_range_m;
  // Written down from words alone: the radar stands over +Z at azimuth 0, azimuth grows towards +X, and
  // the platform flies so that the scene is on its right.
  const Vec horizontal = {std::sin(phi), 0, std::cos(phi)};  // from the aim point towards the radar
  const Vec up = {0, 1, 0};
  const Vec radar = vec(a.aim_m) + r * (std::sin(theta) * horizontal + std::cos(theta) * up);
  // Heading f with the scene on the right, f × up = −horizontal, so f = up × (−horizontal).
  Vec flight = cross(up, Real(-1) * horizontal);
  if (mirrored) flight = Real(-1) * flight;

  Image<double> power(a.n_azimuth, a.n_range);
  constexpr int kPerRow = 6;
  const Real extent = 14.0L / r;
  const int n_angles = 700;
  for (int n = 0; n < a.n_azimuth * kPerRow; ++n) {
    const Real along = ((n + 0.5L) / kPerRow - 0.5L * a.n_azimuth) * Real(a.azimuth_spacing_m);
    const Vec origin = radar + along * flight;
    for (int k = 0; k < n_angles; ++k) {
      const Real incidence = theta + extent * (2 * (k + 0.5L) / n_angles - 1);
      const Vec d = Real(-1) * (std::sin(incidence) * horizontal + std::cos(incidence) * up);
      Real nearest = std::numeric_limits<Real>::infinity(), cosine = 0;
      for (const glm::uvec3& t : scene.mesh.triangles) {
        Real c = 0;
        const Real distance = hit(origin, d, vec(scene.mesh.vertices_m[t.x]),
                                  vec(scene.mesh.vertices_m[t.y]), vec(scene.mesh.vertices_m[t.z]), c);
        if (distance < nearest) {
          nearest = distance;
          cosine = c;
        }
      }
      if (!(nearest < std::numeric_limits<Real>::infinity())) continue;
      const auto j = static_cast<int>(
          std::floor((nearest - r) / Real(a.range_spacing_m) + 0.5L * a.n_range));
      if (j < 0 || j >= a.n_range) continue;
      power(n / kPerRow, j) += double(nearest * cosine * 2 * extent / n_angles /
                                      Real(a.range_spacing_m) / kPerRow);
    }
  }
  Image<float> image(a.n_azimuth, a.n_range);
  for (std::size_t p = 0; p < image.pixels().size(); ++p) image.pixels()[p] = float(power.pixels()[p]);
  return image;
}

/// A solid without any symmetry: nothing but the right geometry gives its image.
Scene lopsided(const glm::dvec3& where) {
  Scene scene = empty_scene(matte(1.0));
  add_piece(scene,
            {where + glm::dvec3(-4.1, 0.0, -2.2), where + glm::dvec3(5.3, 0.0, -1.0),
             where + glm::dvec3(0.9, 0.0, 4.4), where + glm::dvec3(1.7, 6.2, 0.3)},
            {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}, true);
  add_piece(scene,
            {where + glm::dvec3(-6.0, 0.0, 1.0), where + glm::dvec3(-3.6, 0.0, 2.0),
             where + glm::dvec3(-5.2, 0.0, 3.9), where + glm::dvec3(-5.0, 2.7, 1.9)},
            {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}, true);
  return scene;
}

}  // namespace

TEST_CASE("a lopsided solid lands where independent rays put it", "[independent]") {
  std::mt19937 random(20);
  std::uniform_real_distribution<double> azimuth(0.0, 360.0), pitch(20.0, 70.0), far(-5e6, 5e6),
      shift(-1.5, 1.5);
  for (int n = 0; n < 20; ++n) {
    const glm::dvec3 where(far(random), 200.0 * shift(random), far(random));
    const Scene scene = lopsided(where);
    Acquisition view = view_of(pitch(random), n % 2 ? 1e4 : 2e3, 56, 56, 0.4, azimuth(random));
    view.aim_m = where + glm::dvec3(shift(random), shift(random), shift(random));
    INFO("view " << n << " pitch " << deg_from_rad(view.incidence_rad) << " azimuth "
                 << deg_from_rad(view.azimuth_rad));
    const SurfaceEngine engine(scene);
    const Image<float> image = engine.render(engine.plan(view, {.n_elevation = 200, .n_slices = 8})).beta0;
    // The independent image carries the noise of its own point samples, a few per cent.
    CHECK(relative_l2(image, independent_image(scene, view, false)) < 0.08);
    CHECK(relative_l2(image, independent_image(scene, view, true)) > 0.5);
  }
}
