// SPDX-License-Identifier: Apache-2.0
// The field `surface`: its gradients against central differences, its image against a closed form, its file.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "small_set.h"
#include "torch_catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/surface_field.h"

using namespace sarnerf;

namespace {

constexpr double kBallVoxel_m = 0.15, kRadius_m = 1.1;

glm::dvec3 point_of(const SurfaceField& field, std::size_t v) {
  return field.transform().world_from_index(glm::dvec3(field.topology().voxel(v)));
}

void set_distance(SurfaceField& field, const std::function<double(const glm::dvec3&)>& distance_m) {
  const torch::NoGradGuard no_gradients;
  for (std::size_t v = 0; v < field.n_voxels(); ++v)
    field.distance.data_ptr<float>()[v] = static_cast<float>(distance_m(point_of(field, v)));
}

double sphere(const glm::dvec3& p) { return glm::length(p - glm::dvec3(0.03, -0.02, 0.05)) - kRadius_m; }

/// A sphere in bricks that hold everything within the band.
SurfaceField sphere_field(double sharpness_per_m, double band_m = 1.0) {
  BrickTopology topology;
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 3; ++z) topology.insert({x, y, z});
  SurfaceField field({glm::dvec3(0.0), kBallVoxel_m}, std::move(topology), 1.2, band_m);
  set_distance(field, sphere);
  field.set_sharpness(sharpness_per_m);
  field.refresh();
  return field;
}

Acquisition view_from(double azimuth_rad) {
  Acquisition a;
  a.incidence_rad = 0.8;
  a.azimuth_rad = azimuth_rad;
  a.slant_range_m = 5000.0;
  a.n_azimuth = 10;
  a.n_range = 12;
  a.azimuth_spacing_m = a.range_spacing_m = 0.3;
  return a;
}

std::vector<RowRequest> rows_of_views() {
  std::vector<RowRequest> rows;
  for (int v = 0; v < 3; ++v)
    for (int i = 1; i < 9; i += 2) rows.push_back({view_from(0.4 + 2.0 * v), i, 0.3, 0.6});
  return rows;
}

RaySampling fine_sampling(const SurfaceField& field) {
  RaySampling s;
  s.ray_spacing_m = 0.03;
  s.longest_m = field.voxel_size_m();
  return s;
}

}  // namespace

TEST_CASE("gradients of a surface are those of central differences, from 1 to 1e4 per metre") {
  const bool bounce = GENERATE(false, true);
  for (const double sharpness : {1.0, 10.0, 100.0, 1e3, 1e4}) {
    // At 1 per metre, the band ends where 0.005 of depth is left out, in 4.6 m: here it is cut off at 1.7 m, for both.
    SurfaceField field = sphere_field(sharpness, 1.7);
    // Over a black ground, with a bounce by it.
    if (bounce) {
      LevelGround black;
      black.height_m = -1.5;
      black.texture = Image<float>(1, 1);
      black.incidence_rad = {0.8};
      black.gain = {1.0};
      field.ground = std::make_shared<LevelGround>(black);
      field.start_bounce();
    }
    {
      const torch::NoGradGuard no_gradients;
      field.log_albedo.normal_(0.0, 0.3);
      field.log_bounce.normal_(0.3, 0.3);
      field.exponent.fill_(1.4);
    }
    const std::vector<RowRequest> rows = rows_of_views();
    const auto weighted = [&] {
      const torch::Tensor pixels = field.render_rows(rows, fine_sampling(field));
      return (pixels.to(torch::kDouble) * (torch::sin(torch::arange(pixels.numel()) * 0.7) + 1.2)).sum();
    };
    const auto value = [&] {
      const torch::NoGradGuard no_gradients;
      return weighted().item<double>();
    };
    weighted().backward();
    const torch::Tensor albedo_gradient = field.log_albedo.grad().clone(), exponent_gradient = field.exponent.grad().clone();
    const torch::Tensor bounce_gradient = bounce ? field.log_bounce.grad().clone() : torch::Tensor();
    const torch::Tensor distance = field.distance.detach().clone();
    const auto at = [&](const torch::Tensor& shift, auto&& what) {
      field.distance.data().copy_(distance + shift);
      const double v = what();
      field.distance.data().copy_(distance);
      return v;
    };
    const auto wave = [&](int kind) {
      torch::Tensor d = torch::ones_like(distance);
      for (std::size_t v = 0; v < field.n_voxels(); ++v) {
        const glm::dvec3 p = point_of(field, v);
        if (kind > 0) d.data_ptr<float>()[v] = static_cast<float>(std::sin(kind * 1.5 * p.x + 2.0 * p.y) + 0.5);
      }
      return d;
    };
    INFO("sharpness " << sharpness);
    for (int kind = 0; kind < 3; ++kind) {
      // The change of the image over a path is the integral of the gradient along it. So the path may be much longer than
      // the surface is thick, and float32 keeps its digits; but cos^p has a kink where a face turns away, which a path
      // longer than this crosses.
      constexpr double kHalf_m = 2e-4;
      const torch::Tensor direction = wave(kind);
      // 25 points within the thickness of the surface: with 10, the sum's own error is up to 0.7 of what is allowed below.
      const int n_points = std::max(1, static_cast<int>(std::lround(50.0 * kHalf_m * sharpness)));
      double found = 0.0;
      for (int i = 0; i < n_points; ++i)
        found += at(((2 * i + 1.0) / n_points - 1.0) * kHalf_m * direction, [&] {
          field.distance.mutable_grad().zero_();
          weighted().backward();
          return (field.distance.grad() * direction).sum().item<double>() / n_points;
        });
      const double expected = (at(kHalf_m * direction, value) - at(-kHalf_m * direction, value)) / (2.0 * kHalf_m);
      CHECK(found == Approx(expected).epsilon(5e-3).margin(2e-2));
    }
    const auto difference = [&](torch::Tensor& parameter) {
      constexpr double kStep = 1e-2;
      parameter.data().add_(kStep);
      const double up = value();
      parameter.data().sub_(2.0 * kStep);
      const double down = value();
      parameter.data().add_(kStep);
      return (up - down) / (2.0 * kStep);
    };
    CHECK(albedo_gradient.sum().item<double>() == Approx(difference(field.log_albedo)).epsilon(1e-3));
    CHECK(exponent_gradient.item<double>() == Approx(difference(field.exponent)).epsilon(2e-3));
    if (bounce) CHECK(bounce_gradient.sum().item<double>() == Approx(difference(field.log_bounce)).epsilon(1e-3));
  }
}

TEST_CASE("gradients of the directional brightness are those of central differences, and the shape gets none") {
  SurfaceField field = sphere_field(30.0);
  const std::vector<RowRequest> rows = rows_of_views();
  const torch::Tensor before = field.render_rows(rows, fine_sampling(field)).detach();
  field.start_directional();
  CHECK(field.parameters().size() == 1);
  CHECK(torch::equal(field.render_rows(rows, fine_sampling(field)), before));
  {
    const torch::NoGradGuard no_gradients;
    field.directional.normal_(0.0, 0.2);
  }
  const torch::Tensor pixels = field.render_rows(rows, fine_sampling(field));
  const torch::Tensor weight = torch::sin(torch::arange(pixels.numel()) * 0.7) + 1.2;
  (pixels * weight).sum().backward();
  CHECK_FALSE(field.distance.grad().defined());
  CHECK_FALSE(field.log_albedo.grad().defined());
  CHECK_FALSE(field.exponent.grad().defined());
  const auto value = [&] {
    const torch::NoGradGuard no_gradients;
    return (field.render_rows(rows, fine_sampling(field)).to(torch::kDouble) * weight).sum().item<double>();
  };
  for (int harmonic = 0; harmonic < 9; ++harmonic) {
    constexpr double kStep = 1e-2;
    torch::Tensor of = field.directional.data().select(1, harmonic);
    const double expected = [&] {
      of.add_(kStep);
      const double up = value();
      of.sub_(2.0 * kStep);
      const double down = value();
      of.add_(kStep);
      return (up - down) / (2.0 * kStep);
    }();
    INFO("harmonic " << harmonic);
    CHECK(field.directional.grad().select(1, harmonic).sum().item<double>() == Approx(expected).epsilon(2e-3).margin(1e-3));
  }
}

TEST_CASE("a sphere returns the power of its disc") {
  // Brightness cos, integrated over the disc that the sphere covers: 2 pi R² / 3 of solid angle times range squared.
  SurfaceField field = sphere_field(400.0);
  Acquisition view = view_from(1.0);
  view.n_azimuth = view.n_range = 24;
  std::vector<RowRequest> rows;
  for (int i = 0; i < view.n_azimuth; ++i) rows.push_back({view, i});
  RaySampling sampling = fine_sampling(field);
  sampling.sub_rows = 4;
  std::vector<float> pixels(24 * 24);
  field.render_rows(rows, sampling, pixels);
  double power = 0.0;
  for (const float p : pixels) power += double{p} * view.azimuth_spacing_m * view.range_spacing_m;
  const double expected = 2.0 / 3.0 * std::numbers::pi * kRadius_m * kRadius_m;
  // The lattice cuts 0.7 % off a sphere of seven voxels.
  CHECK(power == Approx(expected).epsilon(0.02));
}

TEST_CASE("a surface survives extreme sharpness, plates of a voxel and empty space") {
  for (const double sharpness : {1e-3, 1e4, 1e9}) {
    SurfaceField field = sphere_field(sharpness);
    for (const double thick_m : {0.5 * kBallVoxel_m, 1e-6, -1.0}) {
      set_distance(field, [&](const glm::dvec3& p) { return std::abs(p.y) - 0.5 * thick_m; });
      field.refresh();
      const torch::Tensor pixels = field.render_rows(rows_of_views(), fine_sampling(field));
      CHECK(pixels.isfinite().all().item<bool>());
      CHECK((pixels >= 0.0).all().item<bool>());
      pixels.sum().backward();
      for (const torch::Tensor& parameter : field.parameters()) CHECK(parameter.grad().isfinite().all().item<bool>());
    }
  }
}

TEST_CASE("a surface is restored bit by bit, and a damaged one is refused") {
  SurfaceField field = sphere_field(20.0);
  const bool directional = GENERATE(false, true);
  if (directional) {
    field.start_bounce();
    field.start_directional();
  }
  {
    const torch::NoGradGuard no_gradients;
    field.log_albedo.normal_();
    field.exponent.fill_(0.7);
    field.directional.normal_();
    field.log_bounce.normal_();
  }
  const Archive archive = field.state();
  const auto restored = restore_field(archive, "here");
  CHECK(restored->kind() == "surface");
  CHECK(same_bits(restored->state(), archive));
  const auto image = [](const LearnedField& f) { return render_view(f, view_from(0.5)); };
  CHECK(std::ranges::equal(image(*restored).pixels(), image(field).pixels()));
  for (const char* name : {"distance", "log_albedo", "exponent", "bricks"}) {
    Archive damaged = archive;
    damaged.tensors.erase(name);
    CHECK_THROWS_AS(restore_field(damaged, "here"), CheckpointError);
  }
  Archive damaged = archive;
  damaged.tensors["distance"] = archive.tensors.at("distance").clone();
  damaged.tensors["distance"][5] = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_AS(restore_field(damaged, "here"), CheckpointError);
  damaged.tensors["distance"] = torch::zeros({3});
  CHECK_THROWS_AS(restore_field(damaged, "here"), CheckpointError);
  if (!directional) return;
  damaged = archive;
  damaged.tensors["directional"] = torch::zeros({3, 9});
  CHECK_THROWS_AS(restore_field(damaged, "here"), CheckpointError);
}
