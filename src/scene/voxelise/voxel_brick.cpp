// SPDX-License-Identifier: Apache-2.0
#include "voxelise/voxel_brick.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "vdb/vdb_grids.h"

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

/// Whether a ray into the sky above the horizon is free on this side, from any of the points.
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

/// Finds the sides of a sheet's triangles that the scene's opaque material hides from all directions above the
/// horizon: rays into up to 16 directions from one or four points of the side all hit something. The front is
/// the side that the normal points to. Cost: some fifty microseconds a triangle.
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
      // One point is enough for a triangle that the voxels cannot resolve.
      const bool small = glm::length(b - a) + glm::length(c - b) + glm::length(a - c) < 3.0 * voxel_size_m;
      const std::span<const glm::dvec3> chosen(points.data(), small ? 1 : points.size());
      const double lift_m = 1e-3 * voxel_size_m;
      const bool front = sees_sky(*opaque, chosen, normal, lift_m);
      const bool back = sees_sky(*opaque, chosen, -normal, lift_m);
      // A triangle that is hidden on both sides needs no decision.
      if (front != back) hidden[t] = front ? HiddenSide::back : HiddenSide::front;
    }
  });
  return hidden;
}

/// Pieces smaller than this many voxels in every direction have no inside that voxels can resolve.
constexpr double kSmallPiece = 2.0;

void build_distance(const Scene& scene, VoxelSurface& surface) {
  std::unordered_map<std::uint32_t, std::uint32_t> own;
  std::vector<glm::dvec3> vertices;
  std::vector<glm::uvec3> triangles;
  triangles.reserve(surface.triangles.size());
  for (const std::uint32_t t : surface.triangles) {
    glm::uvec3 corners;
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t vertex = scene.mesh.triangles[t][c];
      const auto [place, is_new] = own.emplace(vertex, static_cast<std::uint32_t>(vertices.size()));
      if (is_new) vertices.push_back(scene.mesh.vertices_m[vertex]);
      corners[c] = place->second;
    }
    triangles.push_back(corners);
  }
  surface.distance = std::make_unique<SurfaceDistance>(vertices, triangles, surface.closed);
}

}  // namespace

std::vector<VoxelSurface> make_voxel_surfaces(const Scene& scene, double voxel_size_m,
                                              const Monitor& monitor) {
  const Mesh& mesh = scene.mesh;
  std::vector<std::vector<std::uint32_t>> of_piece(scene.pieces.size());
  std::vector<Box> box(scene.pieces.size());
  std::vector<double> area(scene.pieces.size(), 0.0);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t piece = mesh.piece[t];
    of_piece[piece].push_back(t);
    const glm::uvec3& c = mesh.triangles[t];
    for (int n = 0; n < 3; ++n) box[piece].include(mesh.vertices_m[c[n]]);
    area[piece] += glm::length(glm::cross(mesh.vertices_m[c.y] - mesh.vertices_m[c.x],
                                          mesh.vertices_m[c.z] - mesh.vertices_m[c.x]));
  }

  std::vector<VoxelSurface> surfaces;
  VoxelSurface sheets;
  for (std::size_t piece = 0; piece < of_piece.size(); ++piece) {
    std::vector<std::uint32_t>& triangles = of_piece[piece];
    if (triangles.empty() || !(area[piece] > 0.0)) continue;
    const Material& material = scene.materials[mesh.material[triangles.front()]];
    const bool closed = scene.pieces[piece].closed;
    const glm::dvec3 size = box[piece].size();
    const bool small = std::max({size.x, size.y, size.z}) < kSmallPiece * voxel_size_m;
    if (material.opaque && (!closed || small)) {
      sheets.triangles.insert(sheets.triangles.end(), triangles.begin(), triangles.end());
    } else if (closed) {
      surfaces.push_back(
          {std::move(triangles), nullptr, true, material.opaque ? nullptr : &material, {}});
    }
  }
  if (!sheets.triangles.empty()) surfaces.push_back(std::move(sheets));
  parallel_for(surfaces.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t s = begin; s < end; ++s) {
      monitor.check();
      build_distance(scene, surfaces[s]);
    }
  });
  for (VoxelSurface& surface : surfaces) {
    if (!surface.closed) surface.hidden = find_hidden_sides(scene, surface, voxel_size_m, monitor);
  }
  return surfaces;
}

namespace {

constexpr std::size_t voxel_index(int x, int y, int z) {
  return static_cast<std::size_t>((x * kBrickSide + y) * kBrickSide + z);
}

/// Calls visit(voxel, world point, nearest point) for the voxels of a brick that lie within `reach` (voxels) of a
/// surface. Distances change by at most one voxel per step, so the loop skips as many voxels as the surface is
/// beyond `reach`.
template <class Visit>
void for_each_voxel_near(const SurfaceDistance& surface, const GridTransform& transform,
                         const glm::ivec3& first, double reach, Visit&& visit) {
  const double voxel_m = transform.voxel_size_m;
  const glm::dvec3 centre = transform.world_from_index(glm::dvec3(first) + 0.5 * (kBrickSide - 1));
  const double half_diagonal = 0.5 * std::sqrt(3.0) * (kBrickSide - 1);
  NearestPoint nearest = surface.nearest(centre);
  if (nearest.distance_m > (half_diagonal + reach) * voxel_m) return;
  for (int x = 0; x < kBrickSide; ++x) {
    for (int y = 0; y < kBrickSide; ++y) {
      for (int z = 0; z < kBrickSide;) {
        const glm::dvec3 point = transform.world_from_index(glm::dvec3(first + glm::ivec3(x, y, z)));
        nearest = surface.nearest(point, nearest);
        const double beyond = nearest.distance_m / voxel_m - reach;
        if (beyond <= 0.0) visit(voxel_index(x, y, z), point, nearest);
        z += 1 + static_cast<int>(std::clamp(beyond, 0.0, double(kBrickSide)));
      }
    }
  }
}

/// One-way extinction of a medium. Brightness is scattering over extinction, so a material that only scatters
/// gets a small extinction, which removes 2e-5 of the power over 100 m.
double extinction_of(const Material& medium, double extinction_per_m) {
  constexpr double kLeast_per_m = 1e-7;
  return medium.scattering_per_m > 0.0 ? std::max(extinction_per_m, kLeast_per_m) : extinction_per_m;
}

void set_medium_attributes(const Material& medium, std::size_t voxel, VoxelBrick& voxels) {
  const double sum = extinction_of(medium, medium.extinction_per_m) +
                     extinction_of(medium, medium.extinction_back_per_m);
  voxels.attributes.set(voxel);
  voxels.gamma0[voxel] = static_cast<float>(sum > 0.0 ? medium.scattering_per_m / sum : 0.0);
  voxels.exponent[voxel] = 0.0f;
  voxels.normal[voxel] = glm::vec3(0.0f, 1.0f, 0.0f);  // without effect: the exponent is 0
  voxels.component[voxel] = Component::other;
}

/// Depth (voxels) used for a point near a sheet. A sheet with a hidden side is opaque on that side only, like the
/// shell of a solid; a sheet seen from both sides is opaque on both.
float sheet_depth(const VoxelSurface& surface, const glm::dvec3& point, const NearestPoint& nearest,
                  double voxel_m) {
  const auto distance = static_cast<float>(nearest.distance_m / voxel_m);
  const HiddenSide hidden = surface.hidden[nearest.triangle];
  if (hidden == HiddenSide::none) return kSheetDepth - distance;
  // Points beyond a sheet's border are on neither side.
  constexpr double kLeastCosine = 0.65;
  const double above = glm::dot(point - nearest.point_m, surface.distance->normal(nearest.triangle));
  const double into = hidden == HiddenSide::front ? above : -above;
  return into > kLeastCosine * nearest.distance_m ? distance : -distance;
}

}  // namespace

VoxelBrick::VoxelBrick() {
  for (auto* array : {&extinction_per_m, &extinction_back_per_m, &scattering_per_m, &gamma0, &exponent}) {
    array->fill(0.0f);
  }
  normal.fill(glm::vec3(0.0f));
  component.fill(Component::none);
}

/// Thickness (voxels) of the material at a voxel, measured from the nearest surface point straight through it.
double BrickVoxeliser::thickness(const VoxelSurface& surface, const glm::dvec3& point_m,
                                 const NearestPoint& nearest, bool inside) const {
  if (!surface.closed) return 0.0;
  const double voxel_m = transform_.voxel_size_m;
  glm::dvec3 inward = -surface.distance->normal(nearest.triangle);
  if (nearest.distance_m > 1e-6 * voxel_m) {
    inward = (inside ? 1.0 : -1.0) * (point_m - nearest.point_m) / nearest.distance_m;
  }
  // Starts a little inside, so that the ray does not hit neighbouring triangles around an edge at once.
  const double start_m = 1e-3 * voxel_m;
  const auto path = surface.distance->free_path(nearest.point_m + start_m * inward, inward, nearest.triangle);
  // Material thinner than start_m ends before the ray starts: the ray then hits nothing, or enters the next solid.
  // A ray that starts at an edge and runs within a face gives no thickness.
  constexpr double kEdgeOn = 1e-6;
  if (!path) return 0.0;
  const double outward = glm::dot(surface.distance->normal(path->triangle), inward);
  if (std::abs(outward) <= kEdgeOn) return std::numeric_limits<double>::infinity();
  if (outward < 0.0) return 0.0;
  return (start_m + path->length_m) / voxel_m;
}

void BrickVoxeliser::set_attributes(const VoxelSurface& surface, const NearestPoint& nearest,
                                    std::size_t voxel, VoxelBrick& voxels) const {
  const std::uint32_t triangle = surface.triangles[nearest.triangle];
  const Material& material = scene_.materials[scene_.mesh.material[triangle]];
  const Object& object = scene_.objects[scene_.pieces[scene_.mesh.piece[triangle]].object];
  const glm::dvec3 in_object = glm::dvec3(object.object_from_world * glm::dvec4(nearest.point_m, 1.0));
  // Squares smaller than voxels would be sampled instead of averaged and could alias with the grid. Their mean, 1,
  // replaces them.
  const bool textured = material.texture.period_m >= transform_.voxel_size_m;
  const double factor = textured ? material.texture.factor(in_object) : 1.0;
  voxels.attributes.set(voxel);
  voxels.gamma0[voxel] = static_cast<float>(material.gamma0 * factor);
  voxels.exponent[voxel] = static_cast<float>(material.exponent);
  voxels.normal[voxel] = glm::vec3(surface.distance->normal(nearest.triangle));
  voxels.component[voxel] = component_[triangle];
}

void BrickVoxeliser::fill_opaque(const glm::ivec3& first, const VoxelSurface& surface,
                                 VoxelBrick& voxels, std::span<float> depth) const {
  const double voxel_m = transform_.voxel_size_m;
  const auto visit = [&](std::size_t voxel, const glm::dvec3& point, const NearestPoint& nearest) {
    float counted = 0.0f;
    if (surface.closed) {
      const bool inside = surface.distance->holds(point, nearest);
      const double depth_m = inside ? nearest.distance_m : -nearest.distance_m;
      counted = static_cast<float>(depth_m / voxel_m);
      if (std::abs(counted) <= kSheetDepth) {
        counted = thickened_depth(counted, static_cast<float>(thickness(surface, point, nearest, inside)));
      }
    } else {
      counted = sheet_depth(surface, point, nearest, voxel_m);
    }
    // If several pieces reach a voxel, it gets the attributes of the piece in which it lies deepest.
    if (counted <= depth[voxel]) return;
    depth[voxel] = counted;
    set_attributes(surface, nearest, voxel, voxels);
    const float two_way = opaque_extinction_per_voxel(counted);
    if (two_way > 0.0f) {
      voxels.occupied.set(voxel);
      voxels.opaque.set(voxel);
      voxels.extinction_per_m[voxel] = static_cast<float>(0.5 * two_way / voxel_m);
      voxels.extinction_back_per_m[voxel] = voxels.extinction_per_m[voxel];
    }
  };
  for_each_voxel_near(*surface.distance, transform_, first, kReach, visit);
}

void BrickVoxeliser::add_medium(const Material& medium, double coverage, std::size_t voxel,
                                VoxelBrick& voxels) const {
  // Opaque material takes precedence: a medium inside it cannot be seen.
  if (!(coverage > 0.0) || voxels.opaque[voxel]) return;
  voxels.occupied.set(voxel);
  voxels.extinction_per_m[voxel] += static_cast<float>(coverage * extinction_of(medium, medium.extinction_per_m));
  voxels.extinction_back_per_m[voxel] +=
      static_cast<float>(coverage * extinction_of(medium, medium.extinction_back_per_m));
  voxels.scattering_per_m[voxel] += static_cast<float>(coverage * medium.scattering_per_m);
  set_medium_attributes(medium, voxel, voxels);
}

void BrickVoxeliser::fill_medium(const glm::ivec3& first, const VoxelSurface& surface,
                                 VoxelBrick& voxels) const {
  const double voxel_m = transform_.voxel_size_m;
  const Material& medium = *surface.medium;
  // A plane cuts a voxel over a range of depths equal to the voxel's width along the plane's normal.
  constexpr double kLargestHalfWidth = 0.87;  // half a voxel's diagonal
  std::array<bool, kBrickVoxels> near_surface{};
  const auto visit = [&](std::size_t voxel, const glm::dvec3& point, const NearestPoint& nearest) {
    const bool inside = surface.distance->holds(point, nearest);
    const glm::dvec3 normal = surface.distance->normal(nearest.triangle);
    const double width = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
    const double depth = (inside ? 1.0 : -1.0) * nearest.distance_m / voxel_m;
    near_surface[voxel] = std::abs(depth) <= kLargestHalfWidth;
    if (!inside && !voxels.attributes[voxel]) set_medium_attributes(medium, voxel, voxels);
    if (!near_surface[voxel]) return;
    double coverage = std::clamp(0.5 + depth / width, 0.0, 1.0);
    const double across = thickness(surface, point, nearest, inside);
    if (across < 2.0 * width) {  // the far side also cuts this voxel
      coverage += std::clamp(0.5 + (across - depth) / width, 0.0, 1.0) - 1.0;
    }
    add_medium(medium, coverage, voxel, voxels);
  };
  for_each_voxel_near(*surface.distance, transform_, first, kReach, visit);
  // The other voxels are wholly inside or wholly outside. Each run of them along z is tested once.
  for (int x = 0; x < kBrickSide; ++x) {
    for (int y = 0; y < kBrickSide; ++y) {
      bool known = false, inside = false;
      for (int z = 0; z < kBrickSide; ++z) {
        const std::size_t voxel = voxel_index(x, y, z);
        if (near_surface[voxel]) {
          known = false;
          continue;
        }
        if (!known) {
          const glm::dvec3 point = transform_.world_from_index(glm::dvec3(first + glm::ivec3(x, y, z)));
          inside = surface.distance->holds(point, surface.distance->nearest(point));
          known = true;
        }
        if (inside) add_medium(medium, 1.0, voxel, voxels);
      }
    }
  }
}

bool BrickVoxeliser::fill(const glm::ivec3& brick, std::span<const std::uint32_t> surfaces,
                          VoxelBrick& voxels) const {
  const glm::ivec3 first = brick * kBrickSide;
  std::array<float, kBrickVoxels> depth;
  depth.fill(-std::numeric_limits<float>::infinity());
  for (const std::uint32_t s : surfaces) {
    if (surfaces_[s].medium == nullptr) fill_opaque(first, surfaces_[s], voxels, depth);
  }
  for (const std::uint32_t s : surfaces) {
    if (surfaces_[s].medium != nullptr) fill_medium(first, surfaces_[s], voxels);
  }
  // Where media overlap, the brightness follows from their summed scattering and extinctions.
  for (std::size_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
    if (!voxels.occupied[voxel] || voxels.opaque[voxel]) continue;
    const float sum = voxels.extinction_per_m[voxel] + voxels.extinction_back_per_m[voxel];
    if (sum > 0.0f) voxels.gamma0[voxel] = voxels.scattering_per_m[voxel] / sum;
  }
  return voxels.occupied.any() || voxels.attributes.any();
}

bool BrickVoxeliser::holds(std::uint32_t surface, const glm::ivec3& voxel) const {
  const glm::dvec3 point = transform_.world_from_index(glm::dvec3(voxel));
  const SurfaceDistance& distance = *surfaces_[surface].distance;
  return distance.holds(point, distance.nearest(point));
}

}  // namespace sarnerf
