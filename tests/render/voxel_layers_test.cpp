// SPDX-License-Identifier: Apache-2.0
// Layers of sparse volumes: the same as those of the mesh that they were made of.
#include <algorithm>

#include "catch.h"
#include "voxel_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

RenderedView with_layers(const Engine& engine, const Acquisition& view) {
  ViewPlan plan = engine.plan(view, {});
  request_layers(plan, {layers_from_text("all"), 0.0});
  return engine.render(plan);
}

/// Pixels in which the masks differ although the expected one does not change within `reach` of them.
int n_unexplained(const Image<std::uint8_t>& found, const Image<std::uint8_t>& expected, int reach) {
  int n = 0;
  for (int i = reach; i < expected.n_azimuth() - reach; ++i) {
    for (int j = reach; j < expected.n_range() - reach; ++j) {
      if (found(i, j) == expected(i, j)) continue;
      bool border = false;
      for (int di = -reach; di <= reach; ++di) {
        for (int dj = -reach; dj <= reach; ++dj) border |= expected(i + di, j + dj) != expected(i, j);
      }
      n += !border;
    }
  }
  return n;
}

}  // namespace

TEST_CASE("layers of voxels add up to the image and agree with those of the mesh", "[voxel][layers]") {
  for (const bool ground : {true, false}) {
    for (const double turn_deg : {0.0, 25.0}) {
      INFO("turned by " << turn_deg << (ground ? ", with" : ", without") << " ground");
      Scene scene = empty_scene(matte(1.0));
      scene.materials.push_back(matte(1.0, 0.1));
      add_box(scene, {12.0, 7.0, 9.0}, rad_from_deg(turn_deg));
      if (ground) scene.ground = Ground{1, 0.0};
      const Acquisition view = view_of(45.0, 1e4, 64, 96);
      const SurfaceEngine surface_engine(scene);
      const VoxelEngine voxel_engine(scene, voxels_of(scene, 0.1));
      const RenderedView surface = with_layers(surface_engine, view);
      const RenderedView voxel = with_layers(voxel_engine, view);
      for (std::size_t n = 0; n < voxel.beta0.pixels().size(); ++n) {
        double total = 0.0;
        for (const auto& layer : voxel.layers.beta0) total += double(layer.pixels()[n]);
        CHECK(total == Approx(voxel.beta0.pixels()[n]).epsilon(1e-6).margin(1e-12));
      }
      CHECK(relative_l2(voxel.layers.values(Layer::wall), surface.layers.values(Layer::wall)) < 0.15);
      CHECK(relative_l2(voxel.layers.values(Layer::roof), surface.layers.values(Layer::roof)) < 0.2);
      // Steps of voxels reach a little further than a slanting wall: one pixel in a thousand.
      CHECK(n_unexplained(voxel.layers.mask, surface.layers.mask, 1) <= 6);
      // Well inside of the parts, as on the mesh.
      int n_inside = 0;
      for (int i = 2; i < view.n_azimuth - 2; ++i) {
        for (int j = 2; j < view.n_range - 2; ++j) {
          const Layers& s = surface.layers;
          bool inside = true;
          const auto alike = [&](int other_i, int other_j) {
            return s.scatterers(other_i, other_j) == s.scatterers(i, j) &&
                   std::abs(s.elevation_m(other_i, other_j) - s.elevation_m(i, j)) < 1.0f;
          };
          for (int d = -2; d <= 2; ++d) inside &= alike(i, j + d) && alike(i + d, j);
          if (!inside || !(s.scatterers(i, j) > 0.0f)) continue;
          ++n_inside;
          CHECK(voxel.layers.scatterers(i, j) == Approx(s.scatterers(i, j)).margin(0.4));  // a slice of three
          CHECK(voxel.layers.incidence_deg(i, j) == Approx(s.incidence_deg(i, j)).margin(1.0));
          CHECK(voxel.layers.elevation_m(i, j) == Approx(s.elevation_m(i, j)).margin(0.15));
        }
      }
      CHECK(n_inside > 200);
    }
  }
}

TEST_CASE("matter without surfaces is other and has no local incidence", "[voxel][layers]") {
  Scene scene = empty_scene(matte(1.0));
  FieldChannels layout;
  layout.basis = SourceBasis::scattering;
  const Box box{{-4.0, 0.0, -4.0}, {4.0, 5.0, 4.0}};
  const VoxelEngine engine(scene, volume_where(0.25, box, {0.3f, 0.2f}, layout, [](const auto&) { return 1.0; }));
  const Acquisition view = view_of(45.0, 1e4, 16, 64);
  const RenderedView rendered = with_layers(engine, view);
  CHECK(sum(rendered.layers.values(Layer::other)) == Approx(sum(rendered.beta0)).epsilon(1e-6));
  const int row = 8, middle = view.n_range / 2;
  CHECK(std::isnan(rendered.layers.incidence_deg(row, middle)));
  CHECK(rendered.layers.elevation_m(row, middle) > 0.0f);
  CHECK(rendered.layers.scatterers(row, middle) == 1.0f);
}
