// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "fuzz_target.h"
#include "readers/readers.h"
#include "repair/repair.h"
#include "readers/scene_file.h"

namespace sarnerf::fuzz {

/// What each piece of a mesh is allowed to be, before repair and after.
template <class Mesh>
void require_sound(const Mesh& mesh, std::size_t n_materials, std::size_t n_groups) {
  for (const glm::dvec3& v : mesh.vertices) {
    require(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z), "vertices are finite");
  }
  for (const glm::uvec3& t : mesh.triangles) {
    require(std::max({t.x, t.y, t.z}) < mesh.vertices.size(), "triangles name vertices that exist");
  }
  const std::size_t n = mesh.triangles.size();
  require(mesh.material.size() == n && mesh.group.size() == n, "each triangle has material and group");
  for (const std::uint32_t m : mesh.material) require(m < n_materials, "materials exist");
  for (const std::uint32_t g : mesh.group) require(g < n_groups, "groups exist");
}

/// Repair follows every reader; small meshes take it through all its cases.
inline void repair(TriangleSoup soup) {
  constexpr std::size_t kMostTriangles = 200;
  if (soup.triangles.size() > kMostTriangles) return;
  MeshEntry entry;
  entry.file = kName;
  require_reach(entry, soup);
  const std::size_t n_materials = soup.materials.names().size(), n_groups = soup.groups.names().size();
  // Opaque and translucent in turn.
  RepairSetup setup;
  for (std::uint32_t m = 0; m < n_materials; ++m) setup.medium_of_material.push_back(m % 2 == 0 ? 0 : m);
  setup.name = kName;
  for (const bool mend : {true, false}) {
    setup.mend = mend;
    RepairCounts counts;
    const RepairedMesh mesh = repair_mesh(soup, setup, counts);
    require_sound(mesh, n_materials, n_groups);
    require(mesh.piece.size() == mesh.triangles.size(), "each triangle has a piece");
    for (const std::uint32_t p : mesh.piece) require(p < mesh.closed.size(), "pieces exist");
  }
}

inline int read_mesh_bytes(TriangleSoup (*read)(const MeshSource&), const std::uint8_t* data,
                           std::size_t size) {
  return read_or_refuse([&] {
    TriangleSoup soup = read(MeshSource{text_of(data, size), kName, MemoryBudget(64'000'000), Monitor{}});
    require(!soup.triangles.empty(), "a mesh has triangles");
    require_sound(soup, soup.materials.names().size(), soup.groups.names().size());
    repair(std::move(soup));
  });
}

}  // namespace sarnerf::fuzz
