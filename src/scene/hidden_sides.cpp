// SPDX-License-Identifier: Apache-2.0
#include "hidden_sides.h"

#include <array>
#include <cmath>
#include <numbers>

#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

constexpr int kDirections = 16;
/// Directions spread evenly over the upper half of the sphere, on a spiral.
std::array<glm::dvec3, kDirections> sky() {
  std::array<glm::dvec3, kDirections> directions;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int n = 0; n < kDirections; ++n) {
    const double up = (n + 0.5) / kDirections, across = std::sqrt(1.0 - up * up);
    directions[static_cast<std::size_t>(n)] = {across * std::cos(golden * n), up,
                                               across * std::sin(golden * n)};
  }
  return directions;
}

std::unique_ptr<SurfaceDistance> all_opaque(const Scene& scene) {
  std::vector<glm::uvec3> triangles;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.materials[scene.mesh.material[t]].opaque) triangles.push_back(scene.mesh.triangles[t]);
  }
  return std::make_unique<SurfaceDistance>(scene.mesh.vertices_m, triangles, false);
}

/// Whether a side sees the sky above the horizon from any of some points.
bool sees_sky(const SurfaceDistance& opaque, std::span<const glm::dvec3> points,
              const glm::dvec3& outward, double lift_m) {
  static const std::array<glm::dvec3, kDirections> directions = sky();
  for (const glm::dvec3& direction : directions) {
    if (glm::dot(direction, outward) < 0.02) continue;
    for (const glm::dvec3& point : points) {
      if (!opaque.meets_any(point + lift_m * outward, direction)) return true;
    }
  }
  return false;
}

}  // namespace

std::vector<HiddenSide> find_hidden_sides(const Scene& scene, const VoxelSurface& sheet,
                                          double voxel_size_m, const Monitor& monitor) {
  const std::unique_ptr<SurfaceDistance> opaque = all_opaque(scene);
  std::vector<HiddenSide> hidden(sheet.triangles.size(), HiddenSide::none);
  parallel_for(hidden.size(), 64, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    for (std::size_t t = begin; t < end; ++t) {
      const glm::uvec3& corner = scene.mesh.triangles[sheet.triangles[t]];
      const glm::dvec3 &a = scene.mesh.vertices_m[corner.x], &b = scene.mesh.vertices_m[corner.y],
                       &c = scene.mesh.vertices_m[corner.z];
      const glm::dvec3 normal = sheet.distance->normal(static_cast<std::uint32_t>(t));
      const glm::dvec3 middle = (a + b + c) / 3.0;
      const std::array<glm::dvec3, 4> points{middle, 0.5 * (middle + a), 0.5 * (middle + b),
                                             0.5 * (middle + c)};
      // One point stands for a triangle that no voxel could resolve.
      const bool small = glm::length(b - a) + glm::length(c - b) + glm::length(a - c) < 3.0 * voxel_size_m;
      const std::span<const glm::dvec3> chosen(points.data(), small ? 1 : points.size());
      const double lift_m = 1e-3 * voxel_size_m;
      const bool front = sees_sky(*opaque, chosen, normal, lift_m);
      const bool back = sees_sky(*opaque, chosen, -normal, lift_m);
      // What nobody sees from either side needs no decision.
      if (front != back) hidden[t] = front ? HiddenSide::back : HiddenSide::front;
    }
  });
  return hidden;
}

}  // namespace sarnerf
