// SPDX-License-Identifier: Apache-2.0
#include "contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <openvdb/math/ConjGradient.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tree/LeafManager.h>

#include "level_surface.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/surface_field.h"
#include "sight.h"

namespace sarnerf {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Voxels on either side of the surface in which the level set is active, as is usual. Extinction ends there; by then no power is
/// left.
constexpr float kHalfWidth = 3.0f;

/// Numbers that a brick may need for each voxel: distance, occupancy, extinction, brightness, exponent and three of the normal.
constexpr std::uint64_t kNumbersPerVoxel = 8;

/// The distance as a level set: clamped to kHalfWidth voxels, and active where it is smaller.
openvdb::FloatGrid::Ptr level_set(const SurfaceField& field, const VoxelLattice& lattice, std::span<const glm::ivec3> bricks,
                                  std::optional<double> floor_m, const Monitor& monitor) {
  const auto band_m = static_cast<float>(kHalfWidth * lattice.transform.voxel_size_m);
  const auto grid = openvdb::FloatGrid::create(band_m);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  // Missing bricks count as 0 in an interpolation: the field beyond them is as far away as the grid knows.
  const auto far_m = static_cast<float>(field.most_band_m());
  std::vector<float> nearer(field.n_voxels());
  const float* const f = field.distance.data_ptr<float>();
  for (std::size_t v = 0; v < nearer.size(); ++v) nearer[v] = f[v] - far_m;
  const BrickView<const float> view{&field.topology(), field.transform(), 1, nearer};

  std::vector<std::unique_ptr<Leaf>> leaves(bricks.size());
  parallel_for(bricks.size(), 16, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    TrilinearSampler sampler(view);
    std::vector<glm::vec3> points_m(kBrickVoxels);
    std::vector<float> values(kBrickVoxels);
    for (std::size_t b = begin; b < end; ++b) {
      const glm::ivec3 origin = bricks[b] * kBrickSide;
      for (int v = 0; v < kBrickVoxels; ++v)
        points_m[static_cast<std::size_t>(v)] = glm::vec3(lattice.transform.world_from_index(glm::dvec3(origin + voxel_in_brick(v))));
      sampler.sample(points_m, values);
      leaves[b] = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), band_m, false);
      for (int v = 0; v < kBrickVoxels; ++v) {
        if (!lattice.holds(origin + voxel_in_brick(v))) continue;
        float distance_m = values[static_cast<std::size_t>(v)] + far_m;
        if (floor_m) distance_m = std::max(distance_m, static_cast<float>(*floor_m) - points_m[static_cast<std::size_t>(v)].y);
        const auto offset = static_cast<openvdb::Index>(v);
        if (std::abs(distance_m) < band_m) leaves[b]->setValueOn(offset, distance_m);
        else leaves[b]->setValueOff(offset, std::copysign(band_m, distance_m));
      }
    }
    if (worker == 0) monitor.report("the body", end, bricks.size());
  });
  monitor.report("the body", bricks.size(), bricks.size());
  for (std::unique_ptr<Leaf>& leaf : leaves) {
    float value = 0.0f;
    bool active = false;
    if (!leaf->isConstant(value, active)) grid->tree().addLeaf(leaf.release());
    else if (value < 0.0f) grid->tree().addTile(1, leaf->origin(), value, active);
  }
  return grid;
}

/// 1 inside, 0 outside, and linear within half a voxel of the surface.
openvdb::FloatGrid::Ptr occupancy_of(const openvdb::FloatGrid& distance) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const auto voxel_m = static_cast<float>(distance.voxelSize().x());
  const auto occupancy = [&](float distance_m) { return std::clamp(0.5f - distance_m / voxel_m, 0.0f, 1.0f); };
  for (auto from = distance.tree().cbeginLeaf(); from; ++from) {
    auto leaf = std::make_unique<Leaf>(from->origin(), 0.0f, false);
    for (openvdb::Index v = 0; v < Leaf::SIZE; ++v)
      if (const float value = occupancy(from->getValue(v)); value > 0.0f) leaf->setValueOn(v, value);
    if (!leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
  }
  auto tile = distance.tree().cbeginValueOff();
  tile.setMaxDepth(openvdb::FloatTree::ValueOffCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile)
    if (*tile < 0.0f) grid->tree().addTile(1, tile.getCoord(), 1.0f, true);
  grid->setTransform(distance.transform().copy());
  return grid;
}

openvdb::FloatGrid::Ptr unseen_grid(const SurfaceMesh& mesh, const openvdb::math::Transform& transform) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setTransform(transform.copy());
  auto values = grid->getAccessor();
  for (std::size_t v = 0; v < mesh.vertices_m.size(); ++v) {
    const glm::dvec3& p = mesh.vertices_m[v];
    const openvdb::Coord at = transform.worldToIndexCellCentered({p.x, p.y, p.z});
    values.setValue(at, std::max(values.getValue(at), mesh.unseen[v] != 0 ? 1.0f : 0.0f));
  }
  return grid;
}

}  // namespace

std::vector<glm::ivec3> bricks_of_surface(const SurfaceField& field, const VoxelLattice& lattice) {
  const std::vector<float> all(field.n_voxels(), 1.0f);
  return bricks_with_matter(Occupancy(BrickView<const float>{&field.topology(), field.transform(), 1, all}, 1), field.transform(),
                            lattice);
}

std::vector<std::string> surface_grid_names() {
  return {"extinction", "brightness", "normal", "exponent", "distance", "unseen", "occupancy"};
}

std::uint64_t surface_grid_bytes(std::size_t n_bricks) {
  return std::uint64_t{n_bricks} * kBrickVoxels * kNumbersPerVoxel * sizeof(float);
}

openvdb::FloatGrid::Ptr surface_distance(const SurfaceField& field, const VoxelLattice& lattice, const GridTransform& in_world,
                                         std::optional<double> floor_m, std::uint64_t max_memory_bytes, const Monitor& monitor) {
  const std::vector<glm::ivec3> bricks = bricks_of_surface(field, lattice);
  require_memory(surface_grid_bytes(bricks.size()), lattice.transform.voxel_size_m, max_memory_bytes);
  const openvdb::FloatGrid::Ptr distance = level_set(field, lattice, bricks, floor_m, monitor);
  distance->setTransform(vdb_transform(in_world));
  return distance;
}

VdbScene surface_grids(const SurfaceField& field, const VoxelLattice& lattice, const openvdb::FloatGrid::Ptr& distance,
                       const SurfaceMesh& contour) {
  std::unique_ptr<VdbScene::Grids> grids = solid_grids(*distance, lattice.transform.voxel_size_m);
  // Missing bricks count as 0 in an interpolation: it is of the deviation from the mean.
  const auto mean = static_cast<float>(field.log_albedo.mean().item<double>());
  const torch::Tensor deviation = (field.log_albedo.detach() - mean).contiguous();
  const auto n_albedo = static_cast<std::size_t>(field.log_albedo.numel());
  const BrickView<const float> albedo{&field.albedo_topology(), field.albedo_transform(), 1,
                                      {deviation.data_ptr<float>(), n_albedo}};
  const float exponent = field.exponent.data_ptr<float>()[0];
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grids->brightness.front()->tree());
  parallel_for(leaves.leafCount(), 16, [&](std::size_t begin, std::size_t end, int) {
    TrilinearSampler sampler(albedo);
    std::vector<glm::vec3> points_m;
    std::vector<float> log_albedo;
    for (std::size_t l = begin; l < end; ++l) {
      points_m.clear();
      for (auto voxel = leaves.leaf(l).cbeginValueOn(); voxel; ++voxel) {
        const openvdb::Coord at = voxel.getCoord();
        points_m.emplace_back(lattice.transform.world_from_index(glm::dvec3(at.x(), at.y(), at.z())));
      }
      log_albedo.resize(points_m.size());
      sampler.sample(points_m, log_albedo);
      std::size_t n = 0;
      for (auto voxel = leaves.leaf(l).beginValueOn(); voxel; ++voxel) voxel.setValue(std::exp(mean + log_albedo[n++]));
      for (auto voxel = grids->exponent->tree().probeLeaf(leaves.leaf(l).origin())->beginValueOn(); voxel; ++voxel)
        voxel.setValue(exponent);
    }
  });
  grids->occupancy = occupancy_of(*distance);
  grids->distance = distance;
  grids->unseen = unseen_grid(contour, distance->transform());
  const std::vector<std::string> names = surface_grid_names();
  grids->distance->setName(names[4]);
  grids->unseen->setName(names[5]);
  grids->occupancy->setName(names[6]);
  return VdbScene(std::move(grids));
}

namespace {

/// Outward normals of unit length at the vertices, weighted by the triangles' areas.
std::vector<glm::dvec3> normals_of(const SurfaceMesh& mesh) {
  std::vector<glm::dvec3> normals(mesh.vertices_m.size(), glm::dvec3(0.0));
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3& a = mesh.vertices_m[t.x];
    const glm::dvec3 area = glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a);
    for (int corner = 0; corner < 3; ++corner) normals[t[corner]] += area;
  }
  for (glm::dvec3& n : normals)
    if (const double length = glm::length(n); length > 0.0) n /= length;
  return normals;
}

}  // namespace

Contour contour(const openvdb::FloatGrid& distance, std::span<const Acquisition> views, const Monitor& monitor) {
  // level_surface() takes what is larger for inside.
  const openvdb::FloatGrid::Ptr depth = distance.deepCopy();
  openvdb::tools::changeBackground(depth->tree(), -depth->background());  // and inactive values beside it, of either sign
  for (auto value = depth->beginValueOn(); value; ++value) value.setValue(-*value);
  Contour result;
  result.mesh = level_surface(*depth, 0.0);
  SurfaceMesh& mesh = result.mesh;

  Box box_m;
  for (const glm::dvec3& v : mesh.vertices_m) box_m.include(v);
  std::vector<SurfaceSample> vertices;
  const std::vector<glm::dvec3> normals = normals_of(mesh);
  for (std::size_t v = 0; v < mesh.vertices_m.size(); ++v) vertices.push_back({mesh.vertices_m[v], normals[v], 0});
  const Sight sight(mesh, box_m, mesh.triangles.size());
  const std::vector<std::uint8_t> seen = sight.seen(vertices, views, monitor);

  std::vector<std::uint32_t> component = components_of(mesh);
  result.n_components = component.back();
  std::vector<std::uint8_t> is_seen(result.n_components, 0);
  for (std::size_t v = 0; v < seen.size(); ++v) is_seen[component[v]] |= seen[v];
  result.n_unseen = static_cast<std::size_t>(std::count(is_seen.begin(), is_seen.end(), std::uint8_t{0}));

  // Vertices keep their order.
  SurfaceMesh kept;
  std::vector<std::uint32_t> number(mesh.vertices_m.size());
  for (std::size_t v = 0; v < mesh.vertices_m.size(); ++v) {
    if (is_seen[component[v]] == 0) continue;
    number[v] = static_cast<std::uint32_t>(kept.vertices_m.size());
    kept.vertices_m.push_back(mesh.vertices_m[v]);
    kept.unseen.push_back(seen[v] != 0 ? 0 : 1);
  }
  for (const glm::uvec3& t : mesh.triangles)
    if (is_seen[component[t.x]] != 0) kept.triangles.emplace_back(number[t.x], number[t.y], number[t.z]);
  mesh = std::move(kept);
  return result;
}

namespace {

/// More neighbours than a vertex of a contour ever has; one with more would stay where it is.
constexpr std::size_t kMostNeighbours = 31;

/// Pairs (vertex, neighbour), ascending, each once.
std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours_of(const SurfaceMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const glm::uvec3& t : mesh.triangles)
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t a = t[corner], b = t[(corner + 1) % 3];
      pairs.emplace_back(a, b);
      pairs.emplace_back(b, a);
    }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/// Moves the unseen vertices of a mesh to the mean of their neighbours, all at once: a sparse symmetric positive definite system.
void relax_unseen(const SurfaceMesh& mesh, std::vector<glm::dvec3>& vertices) {
  namespace pcg = openvdb::math::pcg;
  using Matrix = pcg::SparseStencilMatrix<double, kMostNeighbours + 1>;
  constexpr std::uint32_t kFixed = std::numeric_limits<std::uint32_t>::max();
  const auto pairs = neighbours_of(mesh);
  std::vector<std::uint32_t> n_neighbours(vertices.size(), 0), unknown(vertices.size(), kFixed);
  for (const auto& pair : pairs) ++n_neighbours[pair.first];
  std::uint32_t n = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (mesh.unseen[v] != 0 && n_neighbours[v] <= kMostNeighbours) unknown[v] = n++;
  if (n == 0) return;
  Matrix matrix(n);
  std::array<Matrix::VectorType, 3> sides{Matrix::VectorType(n, 0.0), Matrix::VectorType(n, 0.0), Matrix::VectorType(n, 0.0)};
  for (const auto& [v, neighbour] : pairs) {
    const std::uint32_t row = unknown[v];
    if (row == kFixed) continue;
    matrix.setValue(row, row, n_neighbours[v]);
    if (unknown[neighbour] != kFixed) matrix.setValue(row, unknown[neighbour], -1.0);
    else
      for (int axis = 0; axis < 3; ++axis) sides[static_cast<std::size_t>(axis)][row] += vertices[neighbour][axis];
  }
  const pcg::State enough{.success = false, .iterations = 10'000, .relativeError = 1e-7, .absoluteError = 1e-12};
  pcg::JacobiPreconditioner<Matrix> diagonal(matrix);
  for (int axis = 0; axis < 3; ++axis) {
    Matrix::VectorType solution(n, 0.0);
    for (std::size_t v = 0; v < vertices.size(); ++v)
      if (unknown[v] != kFixed) solution[unknown[v]] = vertices[v][axis];
    pcg::solve(matrix, sides[static_cast<std::size_t>(axis)], solution, diagonal, enough);
    for (std::size_t v = 0; v < vertices.size(); ++v)
      if (unknown[v] != kFixed) vertices[v][axis] = solution[unknown[v]];
  }
}

}  // namespace

openvdb::FloatGrid::Ptr close_unseen(const openvdb::FloatGrid& distance, const SurfaceMesh& contour) {
  if (contour.triangles.empty()) return distance.deepCopy();
  // In voxels of the grid: floats keep their digits anywhere in the world.
  std::vector<glm::dvec3> vertices;
  for (const glm::dvec3& v : contour.vertices_m) {
    const openvdb::Vec3d at = distance.transform().worldToIndex({v.x, v.y, v.z});
    vertices.emplace_back(at.x(), at.y(), at.z());
  }
  relax_unseen(contour, vertices);
  std::vector<openvdb::Vec3s> points;
  for (const glm::dvec3& v : vertices) points.emplace_back(openvdb::Vec3d(v.x, v.y, v.z));
  std::vector<openvdb::Vec3I> triangles;
  for (const glm::uvec3& t : contour.triangles) triangles.emplace_back(t.x, t.y, t.z);
  const auto body = openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*openvdb::math::Transform::createLinearTransform(1.0), points,
                                                                      triangles, kHalfWidth);
  const auto voxel_m = static_cast<float>(distance.voxelSize().x());
  for (auto value = body->beginValueAll(); value; ++value) value.setValue(*value * voxel_m);
  openvdb::tools::changeLevelSetBackground(body->tree(), distance.background());
  body->setTransform(distance.transform().copy());
  const openvdb::FloatGrid::Ptr whole = distance.deepCopy();
  openvdb::tools::csgIntersection(*body, *whole);
  return body;
}

}  // namespace sarnerf
