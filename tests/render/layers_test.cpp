// SPDX-License-Identifier: Apache-2.0
// Layers and masks of buildings against their closed forms (docs/guide/layers.md).
#include <algorithm>
#include <functional>
#include <string>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

RenderedView render_layers(const Scene& scene, const Acquisition& view, const std::string& layers = "all") {
  const SurfaceEngine engine(scene);
  ViewPlan plan = engine.plan(view, {});
  request_layers(plan, {layers_from_text(layers), 0.0});
  return engine.render(plan);
}

/// A building whose front base is seen in the middle of the swath: wall 1, roof 0.5, ground 0.1, all of
/// exponent 1, which its groups name.
Scene building(double width, double height, bool ground) {
  Scene scene = empty_scene(matte(1.0));
  scene.materials.push_back(matte(1.0, 0.5));
  scene.materials.push_back(matte(1.0, 0.1));
  add_box(scene, {24.0, height, width}, 0.0, {0.0, 0.0, -0.5 * width});
  // Triangles 2 and 3 are the box's top.
  scene.mesh.material[2] = scene.mesh.material[3] = 1;
  if (ground) scene.ground = Ground{2, 0.0};
  return scene;
}

/// Range offsets (m) of a building's parts for a plane wave, relative to the front base.
struct Extents {
  Extents(double width, double height, double theta)
      : tip(-height * std::cos(theta)),
        roof_end(width * std::sin(theta) - height * std::cos(theta)),
        shadow_end((width + height * std::tan(theta)) * std::sin(theta)) {}
  double tip, roof_end, shadow_end;
};

/// Largest distance (bins) of a bin whose value is wrong from the nearest border of a part.
double worst_distance(const Acquisition& view, const std::vector<double>& borders_m,
                      const std::function<bool(int)>& right) {
  double worst = 0.0;
  for (int j = 0; j < view.n_range; ++j) {
    if (right(j)) continue;
    double nearest = 1e9;
    for (const double b : borders_m) nearest = std::min(nearest, std::abs(view.bin_offset_m(j) - b));
    worst = std::max(worst, nearest / view.range_spacing_m);
  }
  return worst;
}

struct Case {
  double pitch_deg, width, height;
};
// The buildings of the paper's Fig. 7, and the one whose wall and roof coincide at 35 degrees.
const Case kBuildings[] = {{45.0, 14.0, 8.0}, {45.0, 10.0, 10.0}, {45.0, 8.0, 14.0}, {35.0, 11.4, 8.0}, {60.0, 9.0, 7.0}};

}  // namespace

TEST_CASE("wall, roof and ground have their closed forms and add up to the image", "[layers]") {
  for (const Case& c : kBuildings) {
    INFO("pitch " << c.pitch_deg << ", " << c.width << " x " << c.height);
    const Scene scene = building(c.width, c.height, true);
    const Acquisition view = view_of(c.pitch_deg, 1e5, 16, 160);
    const RenderedView rendered = render_layers(scene, view);
    const double theta = view.incidence_rad;
    const Extents e(c.width, c.height, theta);
    const int row = 7;
    const auto expect = [&](Layer layer, double value, double from_m, double to_m) {
      for (int j = 0; j < view.n_range; ++j) {
        const double near_m = view.bin_offset_m(j - 0.5), far_m = view.bin_offset_m(j + 0.5);
        INFO(std::string(name(layer)) << " in bin " << j);
        const double found = rendered.layers.values(layer)(row, j);
        const double margin_m = view.range_spacing_m;
        if (near_m > from_m + margin_m && far_m < to_m - margin_m) CHECK(found == Approx(value).epsilon(0.005));
        if (far_m < from_m - margin_m || near_m > to_m + margin_m) CHECK(found == 0.0);
      }
    };
    expect(Layer::wall, std::sin(theta) * std::tan(theta), e.tip, 0.0);
    expect(Layer::roof, 0.5 * std::cos(theta) / std::tan(theta), e.tip, e.roof_end);
    expect(Layer::other, 0.0, 1e9, 1e9);
    for (std::size_t n = 0; n < rendered.beta0.pixels().size(); ++n) {
      double total = 0.0;
      for (const auto& layer : rendered.layers.beta0) total += double(layer.pixels()[n]);
      CHECK(total == Approx(rendered.beta0.pixels()[n]).epsilon(1e-6));
    }
  }
}

TEST_CASE("masks have their borders within one bin, with and without a ground", "[layers]") {
  for (const Case& c : kBuildings) {
    for (const bool ground : {false, true}) {
      INFO("pitch " << c.pitch_deg << ", " << c.width << " x " << c.height << (ground ? " with" : " without") << " ground");
      const Acquisition view = view_of(c.pitch_deg, 1e5, 16, 160);
      const RenderedView rendered = render_layers(building(c.width, c.height, ground), view, "mask");
      const Extents e(c.width, c.height, view.incidence_rad);
      const double shadow_from = std::max(0.0, e.roof_end);
      const auto expected = [&](int j) {
        const double x = view.bin_offset_m(j);
        // Nearer than the front base the plane is seen, with wall and roof before it; behind it, the
        // roof alone.
        if (x > e.tip && x < 0.0) return MaskValue::layover;
        return x > shadow_from && x < e.shadow_end ? MaskValue::shadow : MaskValue::none;
      };
      for (const int row : {4, 7, 11}) {
        const double worst = worst_distance(view, {e.tip, 0.0, e.roof_end, e.shadow_end}, [&](int j) {
          return rendered.layers.mask(row, j) == static_cast<std::uint8_t>(expected(j));
        });
        CHECK(worst <= 1.0);
      }
      CHECK(std::count(rendered.layers.mask.row(7).begin(), rendered.layers.mask.row(7).end(), 1) >= 5);
      CHECK(std::count(rendered.layers.mask.row(7).begin(), rendered.layers.mask.row(7).end(), 2) >= 5);
    }
  }
}

TEST_CASE("a wall in the shadow of another is hidden ground that something answers from", "[layers]") {
  // Behind a low wall a tall one rises out of the shadow: its lower bins are seen before the plane that
  // lies hidden; a slope towards the radar folds over it.
  Scene scene = empty_scene(matte(1.0));
  add_box(scene, {24.0, 6.0, 2.0}, 0.0, {0.0, 0.0, 4.0});
  add_box(scene, {24.0, 14.0, 6.0}, 0.0, {0.0, 0.0, -6.0});
  const Acquisition view = view_of(45.0, 1e5, 16, 200);
  const RenderedView rendered = render_layers(scene, view);
  const auto row = rendered.layers.mask.row(7);
  CHECK(std::count(row.begin(), row.end(), 3) > 0);
  for (int j = 0; j < view.n_range; ++j) {
    const float n = rendered.layers.scatterers(7, j);
    if (rendered.layers.mask(7, j) == 3) CHECK(n > 1.0f);
    if (rendered.layers.mask(7, j) == 1) CHECK(n < 0.5f);
  }
}

TEST_CASE("incidence, elevation and number of scatterers are those of the faces seen", "[layers]") {
  const double width = 16.0, height = 8.0;
  const Acquisition view = view_of(40.0, 1e5, 16, 160);
  const double theta = view.incidence_rad;
  const Extents e(width, height, theta);
  const int row = 7;
  const Scene scene = building(width, height, true);
  const RenderedView rendered = render_layers(scene, view);
  int n_three = 0, n_roof = 0, n_ground = 0;
  for (int j = 0; j < view.n_range; ++j) {
    const double x = view.bin_offset_m(j), margin = view.range_spacing_m * 1.5;
    const Layers& l = rendered.layers;
    if (x > e.tip + margin && x < std::min(0.0, e.roof_end) - margin) {
      CHECK(l.scatterers(row, j) == 3.0f);
      const double wall = std::sin(theta) * std::tan(theta), roof = 0.5 * std::cos(theta) / std::tan(theta);
      const double ground = 0.2 * roof, all = wall + roof + ground;
      const double degrees = 90.0 - 40.0;
      CHECK(l.incidence_deg(row, j) == Approx((wall * degrees + (roof + ground) * 40.0) / all).margin(0.1));
      CHECK(l.elevation_m(row, j) ==
            Approx((wall * -x / std::cos(theta) + roof * height) / all).margin(0.05));
      ++n_three;
    }
    if (x > margin && x < e.roof_end - margin) {
      CHECK(l.scatterers(row, j) == 1.0f);
      CHECK(l.incidence_deg(row, j) == Approx(40.0).margin(0.1));
      CHECK(l.elevation_m(row, j) == Approx(height).margin(0.01));
      ++n_roof;
    }
    if (x < e.tip - margin || x > e.shadow_end + margin) {
      CHECK(l.scatterers(row, j) == 1.0f);
      CHECK(l.elevation_m(row, j) == Approx(0.0).margin(0.01));
      CHECK(l.incidence_deg(row, j) == Approx(40.0).margin(0.1));
      ++n_ground;
    }
    if (x > std::max(0.0, e.roof_end) + margin && x < e.shadow_end - margin) {
      CHECK(l.scatterers(row, j) == 0.0f);
      CHECK(std::isnan(l.incidence_deg(row, j)));
      CHECK(std::isnan(l.elevation_m(row, j)));
    }
  }
  CHECK(n_three > 5);
  CHECK(n_ground > 20);
  CHECK(n_roof > 5);

  // Wall alone: incidence and height of a facing wall.
  Scene wall = empty_scene(matte(1.0));
  add_sheet(wall, {-12.0, 0.0, 0.0}, {24.0, 0.0, 0.0}, {0.0, height, 0.0});
  const RenderedView alone = render_layers(wall, view);
  for (int j = 0; j < view.n_range; ++j) {
    const double x = view.bin_offset_m(j);
    if (!(x > e.tip + 0.3 && x < -0.3)) continue;
    CHECK(alone.layers.incidence_deg(row, j) == Approx(50.0).margin(0.1));
    CHECK(alone.layers.elevation_m(row, j) == Approx(-x / std::cos(theta)).margin(0.02));
    CHECK(alone.layers.scatterers(row, j) == 1.0f);
  }
}

TEST_CASE("translucent matter is other; it hides the plane when less than half of the power returns", "[layers]") {
  const Acquisition view = view_of(45.0, 1e5, 16, 128);
  for (const double extinction : {0.02, 0.5}) {
    Scene scene = empty_scene(fog(extinction, 0.3));
    scene.materials.push_back(matte(1.0, 0.1));
    scene.ground = Ground{1, 0.0};
    add_box(scene, {24.0, 5.0, 8.0});
    const RenderedView rendered = render_layers(scene, view);
    double media = 0.0, ground = 0.0, image = 0.0;
    for (std::size_t n = 0; n < rendered.beta0.pixels().size(); ++n) {
      media += double(rendered.layers.values(Layer::other).pixels()[n]);
      ground += double(rendered.layers.values(Layer::ground).pixels()[n]);
      image += double(rendered.beta0.pixels()[n]);
    }
    CHECK(media > 0.0);
    CHECK(media + ground == Approx(image).epsilon(1e-6));
    // Behind the box's foot, where all of it lies before the plane: 5 m high, at least 5 √2 m of it.
    const int behind = view.n_range / 2 + 1;
    CHECK(rendered.layers.mask(7, behind) == (extinction > 0.1 ? 0 : 2));
    CHECK(std::isnan(rendered.layers.incidence_deg(7, behind)) == false);
  }
}

TEST_CASE("the image does not depend on layers, nor layers on threads", "[layers]") {
  Scene scene = building(10.0, 9.0, true);
  add_box(scene, {5.0, 4.0, 3.0}, 0.7, {6.0, 0.0, 8.0});
  const Acquisition view = view_of(50.0, 1e4, 40, 90);
  const SurfaceEngine engine(scene);
  const ViewPlan plain = engine.plan(view, {});
  ViewPlan with = plain;
  request_layers(with, {layers_from_text("all"), 0.0});
  CHECK(with.memory_bytes > plain.memory_bytes);
  const RenderedView a = engine.render(plain);
  CHECK(a.layers.set.empty());
  CHECK(a.layers.mask.pixels().empty());
  const auto on_threads = [&](int n_threads) {
    const ThreadLimit limit(n_threads);
    return engine.render(with);
  };
  const RenderedView b = on_threads(1), c = on_threads(3);
  const auto same = [](const auto& p, const auto& q) {
    return std::equal(p.pixels().begin(), p.pixels().end(), q.pixels().begin(), q.pixels().end(),
                      [](auto x, auto y) { return x == y || (x != x && y != y); });
  };
  CHECK(same(a.beta0, b.beta0));
  CHECK(same(b.layers.mask, c.layers.mask));
  for (const Layer layer : {Layer::ground, Layer::wall, Layer::roof, Layer::other, Layer::incidence,
                            Layer::elevation, Layer::scatterers, Layer::error}) {
    CHECK_FALSE(b.layers.values(layer).pixels().empty());
    CHECK(same(b.layers.values(layer), c.layers.values(layer)));
  }
}

TEST_CASE("names of layers", "[layers]") {
  CHECK(layers_from_text("none").empty());
  const LayerSet some = layers_from_text("wall,mask");
  CHECK(some.has(Layer::wall));
  CHECK(some.has(Layer::mask));
  CHECK_FALSE(some.has(Layer::roof));
  CHECK(bytes_per_pixel(some) == 5);
  CHECK(bytes_per_pixel(layers_from_text("all")) == 33);
  CHECK_THROWS_AS(layers_from_text("walls"), UsageError);
  CHECK_THROWS_AS(layers_from_text("wall,"), UsageError);
  CHECK_THROWS_AS(layers_from_text(""), UsageError);
}
