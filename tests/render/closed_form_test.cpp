// SPDX-License-Identifier: Apache-2.0
// Scenes whose images are known on paper (docs/method/equations.md, closed forms).
#include <string>

#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kPitches_deg[] = {20.0, 35.0, 45.0, 55.0, 70.0};
constexpr double kAltitudes_m[] = {1e3, 1e4, 7e5};

std::string at(double pitch_deg, double altitude_m) {
  return "pitch " + std::to_string(pitch_deg) + " altitude " + std::to_string(altitude_m);
}

/// First and last bin of row i that holds anything, as range offsets of their outer borders (m).
std::pair<double, double> occupied_m(const Image<float>& image, const Acquisition& view, int i) {
  int first = -1, last = -1;
  for (int j = 0; j < view.n_range; ++j) {
    if (image(i, j) <= 0.0f) continue;
    if (first < 0) first = j;
    last = j;
  }
  return {view.bin_offset_m(first - 0.5), view.bin_offset_m(last + 0.5)};
}

/// Range offset of a point at a height and a ground distance beyond the aim point, for a radar infinitely
/// far away: docs/method/equations.md, E6. At 1 km wave fronts are curved by some decimetres over 20 m.
struct PlaneWave {
  explicit PlaneWave(const Acquisition& view)
      : theta(view.incidence_rad),
        margin_m(view.range_spacing_m + (view.altitude_m() < 5e3 ? 0.4 : 0.0)) {}
  double offset_m(double height_m, double beyond_m) const {
    return beyond_m * std::sin(theta) - height_m * std::cos(theta);
  }
  double theta, margin_m;
};

/// The same for the radar where it is.
struct Sphere {
  explicit Sphere(const Acquisition& view)
      : height(view.altitude_m()), distance(view.slant_range_m * std::sin(view.incidence_rad)),
        range(view.slant_range_m) {}
  double offset_m(double height_m, double beyond_m) const {
    return std::hypot(height - height_m, distance + beyond_m) - range;
  }
  /// Where the ray over an edge meets the ground.
  double shadow_m(double height_m, double beyond_m) const {
    return std::hypot(height, (distance + beyond_m) * height / (height - height_m)) - range;
  }
  double height, distance, range;
};

}  // namespace

TEST_CASE("flat ground is gamma(theta_j) cot theta_j", "[closed-form]") {
  for (const double pitch : kPitches_deg) {
    for (const double altitude : kAltitudes_m) {
      for (const double exponent : {0.0, 1.0, 2.0}) {
        INFO(at(pitch, altitude));
        Scene scene = empty_scene(matte(exponent, 0.7));
        scene.ground = Ground{0, 0.0};
        const Acquisition view = view_of(pitch, altitude, 8, 128);
        const Image<float> image = render(scene, view);
        for (int j = 0; j < view.n_range; ++j) {
          const double cosine = view.altitude_m() / view.range_m(j);
          const double expected =
              0.7 * std::pow(cosine, exponent) * cosine / std::sqrt(1.0 - cosine * cosine);
          CHECK(image(3, j) == Approx(expected).epsilon(0.005));
        }
      }
    }
  }
}

TEST_CASE("a ground that rays must sample agrees with the closed form", "[closed-form]") {
  // A checker of vanishing contrast switches the closed form off and the rays on.
  Material material = matte(1.0);
  material.texture = {Texture::Kind::checker, 1.0, 1e-9, {}};
  for (const double pitch : kPitches_deg) {
    Scene textured = empty_scene(material), plain = empty_scene(matte(1.0));
    textured.ground = plain.ground = Ground{0, 0.0};
    const Acquisition view = view_of(pitch, 1e4, 4, 64);
    CHECK(relative_l2(render(textured, view), render(plain, view)) < 5e-4);
  }
}

TEST_CASE("a wall that faces the radar is gamma tan theta over h cos theta", "[closed-form]") {
  for (const double pitch : kPitches_deg) {
    for (const double altitude : kAltitudes_m) {
      INFO(at(pitch, altitude));
      const double height = 8.0;
      Scene scene = empty_scene(matte());
      add_sheet(scene, {-20.0, 0.0, 0.0}, {40.0, 0.0, 0.0}, {0.0, height, 0.0});
      const Acquisition view = view_of(pitch, altitude, 16, 128);
      const Image<float> image = render(scene, view);
      const auto [near, far] = occupied_m(image, view, 8);
      const double theta = view.incidence_rad;
      CHECK(near == Approx(-height * std::cos(theta)).margin(view.range_spacing_m));
      CHECK(far == Approx(0.0).margin(view.range_spacing_m));
      const double ground_distance_m = view.slant_range_m * std::sin(theta);
      int n_inner = 0;
      for (int j = 0; j < view.n_range; ++j) {
        if (view.bin_offset_m(j - 0.5) < near + view.range_spacing_m ||
            view.bin_offset_m(j + 0.5) > far - view.range_spacing_m) continue;
        const double local = std::asin(ground_distance_m / view.range_m(j));
        CHECK(image(8, j) == Approx(std::tan(local)).epsilon(0.005));
        ++n_inner;
      }
      CHECK(n_inner >= 5);
    }
  }
}

TEST_CASE("a flat roof is gamma cot theta over w sin theta", "[closed-form]") {
  for (const double pitch : kPitches_deg) {
    for (const double altitude : kAltitudes_m) {
      INFO(at(pitch, altitude));
      const double width = 14.0, height = 8.0;
      Scene scene = empty_scene(matte());
      add_sheet(scene, {-20.0, height, 0.5 * width}, {40.0, 0.0, 0.0}, {0.0, 0.0, -width});
      Acquisition view = view_of(pitch, altitude, 16, 128);
      view.aim_m = {0.0, 0.0, 0.0};
      const Image<float> image = render(scene, view);
      const auto [near, far] = occupied_m(image, view, 8);
      const PlaneWave wave(view);
      CHECK(near == Approx(wave.offset_m(height, -0.5 * width)).margin(wave.margin_m));
      CHECK(far == Approx(wave.offset_m(height, 0.5 * width)).margin(wave.margin_m));
      const Sphere sphere(view);
      CHECK(near == Approx(sphere.offset_m(height, -0.5 * width)).margin(view.range_spacing_m));
      CHECK(far == Approx(sphere.offset_m(height, 0.5 * width)).margin(view.range_spacing_m));
      for (int j = 0; j < view.n_range; ++j) {
        if (view.bin_offset_m(j - 0.5) < near + view.range_spacing_m ||
            view.bin_offset_m(j + 0.5) > far - view.range_spacing_m) continue;
        const double cosine = (view.altitude_m() - height) / view.range_m(j);
        CHECK(image(8, j) == Approx(cosine / std::sqrt(1.0 - cosine * cosine)).epsilon(0.005));
      }
    }
  }
}

TEST_CASE("the shadow of a box lies where the closed form puts it", "[closed-form]") {
  for (const double pitch : kPitches_deg) {
    for (const double altitude : kAltitudes_m) {
      INFO(at(pitch, altitude));
      const double w = 10.0, h = 6.0;
      Scene scene = empty_scene(matte());
      add_box(scene, {60.0, h, w});
      scene.ground = Ground{0, 0.0};
      const Acquisition view = view_of(pitch, altitude, 8, 256);
      const Image<float> image = render(scene, view);
      const double theta = view.incidence_rad;
      const double front_m = -0.5 * w * std::sin(theta);  // R₀ − r: front base, w/2 before the centre
      const double begin = front_m + std::max(0.0, w * std::sin(theta) - h * std::cos(theta));
      const double end = front_m + (w + h * std::tan(theta)) * std::sin(theta);
      double first = 1e9, last = -1e9;
      for (int j = 0; j < view.n_range; ++j) {
        if (image(4, j) > 0.0f) continue;
        first = std::min(first, view.bin_offset_m(j - 0.5));
        last = std::max(last, view.bin_offset_m(j + 0.5));
      }
      const PlaneWave wave(view);
      CHECK(first == Approx(begin).margin(wave.margin_m));
      CHECK(last == Approx(end).margin(wave.margin_m));
      const Sphere sphere(view);
      const double sphere_begin =
          std::max(sphere.offset_m(0.0, -0.5 * w), sphere.offset_m(h, 0.5 * w));
      CHECK(first == Approx(sphere_begin).margin(view.range_spacing_m));
      CHECK(last == Approx(sphere.shadow_m(h, 0.5 * w)).margin(view.range_spacing_m));
    }
  }
}

TEST_CASE("wall and roof of the paper's three buildings are ordered as in eqs. 32-34",
          "[closed-form]") {
  struct Building {
    double width, height;
    int order;  // of w/h against cot θ
  };
  const auto check = [](double pitch, const Building& b) {
    INFO("pitch " << pitch << " w " << b.width << " h " << b.height);
    const double theta = rad_from_deg(pitch);
    // Roof and wall apart, each alone: the far ends of both layover intervals.
    Scene wall = empty_scene(matte()), roof = empty_scene(matte());
    add_sheet(wall, {-8.0, 0.0, 0.5 * b.width}, {16.0, 0.0, 0.0}, {0.0, b.height, 0.0});
    add_sheet(roof, {-8.0, b.height, 0.5 * b.width}, {16.0, 0.0, 0.0}, {0.0, 0.0, -b.width});
    Acquisition view = view_of(pitch);
    const auto [wall_near, wall_far] = occupied_m(render(wall, view), view, 64);
    const auto [roof_near, roof_far] = occupied_m(render(roof, view), view, 64);
    CHECK(wall_near == Approx(roof_near).margin(view.range_spacing_m));  // they share an edge
    const double longer = roof_far - wall_far;
    CHECK(longer == Approx(b.width * std::sin(theta) - b.height * std::cos(theta))
                        .margin(view.range_spacing_m));
    if (b.order > 0) CHECK(longer > view.range_spacing_m);
    if (b.order == 0) CHECK(std::abs(longer) <= view.range_spacing_m);
    if (b.order < 0) CHECK(longer < -view.range_spacing_m);
  };
  check(45.0, {14.0, 8.0, +1});
  check(45.0, {10.0, 10.0, 0});
  check(45.0, {8.0, 14.0, -1});
  const double cot35 = 1.0 / std::tan(rad_from_deg(35.0));
  check(35.0, {10.0 * cot35, 10.0, 0});
  check(35.0, {10.0, 10.0, -1});  // with depression taken for incidence this would be +1
  check(35.0, {14.0, 8.0, +1});
}

TEST_CASE("where wall and roof coincide their brightness adds", "[closed-form]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {16.0, 10.0, 10.0});
  const Acquisition view = view_of(45.0);
  const Image<float> image = render(scene, view);
  const double centre_m = -10.0 * std::cos(view.incidence_rad);
  const int j = static_cast<int>(centre_m / view.range_spacing_m + 64.0);
  CHECK(image(64, j) == Approx(2.0).epsilon(0.005));
}
