// SPDX-License-Identifier: Apache-2.0
#include "voxel_surface.h"

#include <algorithm>
#include <unordered_map>

#include "hidden_sides.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

/// Pieces smaller than this many voxels in every direction have no inside that voxels could show.
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

}  // namespace sarnerf
