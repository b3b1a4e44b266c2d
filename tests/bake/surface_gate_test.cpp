// SPDX-License-Identifier: Apache-2.0
// What the field `surface` must be able to tell before anything is learned with it: images of the true body fit better than
// those of bodies that are half a pixel too large, too small, or elsewhere. The images are by the surface engine, which has no
// lattice; the field has one of half a pixel.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "../nerf/torch_catch.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/surface_field.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/surface_distance.h"
#include "solid_meshes.h"
#include "surface_scene.h"

using namespace sarnerf;

namespace {

constexpr double kPixel_m = test::kScenePixel_m;
constexpr double kBand_m = 1.0;
constexpr double kSoftness_m = 0.1 * kPixel_m;

SurfaceMesh mesh_of(const std::string& file) {
  const Scene scene = load_scene(SARNERF_DATA "/" + file, {});
  return {scene.mesh.vertices_m, scene.mesh.triangles};
}

SurfaceMesh torus(const glm::dvec3& centre, double radius, double tube) {
  constexpr std::uint32_t kAround = 96, kOfTube = 48;
  SurfaceMesh mesh;
  for (std::uint32_t i = 0; i < kAround; ++i) {
    for (std::uint32_t j = 0; j < kOfTube; ++j) {
      const double u = 2.0 * std::numbers::pi * i / kAround, v = 2.0 * std::numbers::pi * j / kOfTube;
      const double r = radius + tube * std::cos(v);
      mesh.vertices_m.push_back(centre + glm::dvec3(r * std::cos(u), tube * std::sin(v), r * std::sin(u)));
      const auto at = [](std::uint32_t a, std::uint32_t b) { return a % kAround * kOfTube + b % kOfTube; };
      mesh.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j));
      mesh.triangles.emplace_back(at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
    }
  }
  return mesh;
}

/// A field around the scene's box; its distances are to be set.
SurfaceField field_around(const Box& box_m) {
  const GridTransform transform{glm::dvec3(0.0), 0.5 * kPixel_m};
  BrickTopology topology;
  const glm::ivec3 first = brick_of_voxel(glm::ivec3(glm::floor(transform.index_from_world(box_m.min - kBand_m))));
  const glm::ivec3 last = brick_of_voxel(glm::ivec3(glm::ceil(transform.index_from_world(box_m.max + kBand_m))));
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z) topology.insert({x, y, z});
  return {transform, std::move(topology), 4.0 * kPixel_m, kBand_m};
}

/// Signed distances of the body at all voxels, as if it were moved by `by_m`.
std::vector<float> distances(const SurfaceField& field, const SurfaceDistance& body, const glm::dvec3& by_m) {
  std::vector<float> f(field.n_voxels());
  parallel_for(field.topology().n_bricks(), 4, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t v = begin * kBrickVoxels; v < end * kBrickVoxels; ++v) {
      const glm::ivec3 voxel = field.topology().voxel(v);
      const glm::dvec3 point_m = field.transform().world_from_index(glm::dvec3(voxel)) - by_m;
      const NearestPoint near = body.nearest(point_m);
      f[v] = static_cast<float>(body.holds(point_m, near) ? -near.distance_m : near.distance_m);
    }
  });
  return f;
}

void set_distance(SurfaceField& field, const std::vector<float>& f, double larger_m = 0.0) {
  const torch::NoGradGuard no_gradients;
  for (std::size_t v = 0; v < f.size(); ++v)
    field.distance.data_ptr<float>()[v] = static_cast<float>(std::min(kBand_m, double{f[v]} - larger_m));
  field.refresh();
}

Image<float> render(const SurfaceField& field, const Acquisition& view) {
  std::vector<RowRequest> rows;
  for (int i = 0; i < view.n_azimuth; ++i) rows.push_back({view, i});
  RaySampling sampling;
  sampling.sub_rows = 3;
  sampling.longest_m = field.voxel_size_m();
  sampling.ray_spacing_m = 0.5 * field.voxel_size_m();
  Image<float> image(view.n_azimuth, view.n_range);
  field.render_rows(rows, sampling, image.pixels());
  return image;
}

}  // namespace

TEST_CASE("the true body fits images better than bodies half a pixel wrong") {
  const auto [name, mesh] = GENERATE(table<const char*, SurfaceMesh>({
      {"cuboid", mesh_of("cuboid.obj")},
      {"inverted platform", mesh_of("platform_inverted.obj")},
      {"L-building", mesh_of("l_building.obj")},
      {"sphere", test::sphere_mesh({0.0, 0.0, 0.0}, 4.0, 4)},
      {"torus", torus({0.0, 0.0, 0.0}, 4.0, 1.5)},
      {"plate of two voxels", test::box_mesh({-5.0, 0.0, -4.0}, {5.0, kPixel_m, 4.0})},
  }));
  INFO(name);
  const Scene scene = test::scene_of(mesh);
  const SurfaceEngine engine(scene);
  std::vector<Image<float>> truth;
  const std::vector<Acquisition> views{test::view_from(0.2), test::view_from(2.3), test::view_from(4.7)};
  for (const Acquisition& view : views) {
    Sampling sampling;
    sampling.n_slices = 9;
    sampling.ray_spacing_m = 0.05;
    truth.push_back(engine.render(engine.plan(view, sampling)).beta0);
  }
  const SurfaceDistance body(scene.mesh.vertices_m, scene.mesh.triangles, true);
  SurfaceField field = field_around(scene.box);
  field.set_sharpness(1.0 / kSoftness_m);
  const auto error = [&](const std::vector<float>& f, double larger_m = 0.0) {
    set_distance(field, f, larger_m);
    double squares = 0.0, all = 0.0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const Image<float> image = render(field, views[v]);
      for (std::size_t p = 0; p < image.pixels().size(); ++p) {
        const double is = double{image.pixels()[p]}, should = double{truth[v].pixels()[p]};
        squares += (is - should) * (is - should);
        all += should * should;
      }
    }
    return std::sqrt(squares / all);
  };
  constexpr double kHalf_m = 0.5 * kPixel_m;
  const std::vector<float> exact = distances(field, body, glm::dvec3(0.0));
  const double best = error(exact);
  CHECK(best < 0.2);
  CHECK(error(exact, kHalf_m) > 1.5 * best);
  CHECK(error(exact, -kHalf_m) > 1.5 * best);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 by_m(0.0);
    by_m[axis] = kHalf_m;
    CHECK(error(distances(field, body, by_m)) > 1.1 * best);
  }
}

TEST_CASE("an opaque plane lies where its distance says, to a centimetre, whatever its place on lattice and bins") {
  constexpr double kSharp_m = 0.01;
  Acquisition view = test::view_from(0.3);
  view.n_azimuth = 1;
  view.n_range = 8;
  const RadarFrame frame = radar_frame(view);
  const double border_m = view.bin_offset_m(3.5);
  SurfaceField field = field_around({glm::dvec3(-0.6), glm::dvec3(0.6)});
  field.set_sharpness(1.0 / kSharp_m);
  const glm::dvec3 across = glm::normalize(glm::cross(frame.k, frame.h));
  for (const double incidence_deg : {0.0, 40.0, 70.0}) {
    const double cosine = std::cos(incidence_deg * std::numbers::pi / 180.0);
    const glm::dvec3 normal = -cosine * frame.k + std::sqrt(1.0 - cosine * cosine) * across;
    for (const double shift_m : {0.0, 0.043, 0.098}) {
      // One ray through the aim point meets the plane at this range offset. The lattice lies elsewhere for each shift.
      const auto power_before_border = [&](double offset_m) {
        std::vector<float> f(field.n_voxels());
        for (std::size_t v = 0; v < f.size(); ++v) {
          const glm::ivec3 voxel = field.topology().voxel(v);
          f[v] = static_cast<float>(glm::dot(normal, field.transform().world_from_index(glm::dvec3(voxel)) - offset_m * frame.k));
        }
        set_distance(field, f);
        RowRequest row{view, 0};
        row.even = Fan{-0.5e-6, 1e-6, 1};
        RaySampling sampling;
        sampling.longest_m = field.voxel_size_m();
        std::vector<float> pixels(8);
        field.render_rows({&row, 1}, sampling, pixels);
        double before = 0.0, all = 0.0;
        for (std::size_t j = 0; j < pixels.size(); ++j) {
          all += double{pixels[j]};
          if (j < 4) before += double{pixels[j]};
        }
        return before / all;
      };
      view.range_shift_m = shift_m;
      double low_m = border_m + shift_m - 0.25, high_m = low_m + 0.5;
      REQUIRE(power_before_border(low_m) > 0.99);
      REQUIRE(power_before_border(high_m) < 0.01);
      for (int n = 0; n < 16; ++n) {
        const double middle_m = 0.5 * (low_m + high_m);
        (power_before_border(middle_m) > 0.5 ? low_m : high_m) = middle_m;
      }
      INFO("incidence " << incidence_deg << " degrees, shift " << shift_m << " m, found " << low_m - border_m - shift_m << " m off");
      CHECK(std::abs(low_m - border_m - shift_m) * cosine < 0.01);
    }
  }
}
