// SPDX-License-Identifier: Apache-2.0
#include "level_surface.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Places are whole multiples of a voxel's 1024th: equal or apart by far more than double rounds world coordinates,
/// and areas are exact.
constexpr double kPlacesPerVoxel = 1024.0;

using Place = glm::i64vec3;

struct Quads {
  std::vector<Place> places;
  std::vector<openvdb::Vec4I> corners;  ///< clockwise seen from outside
};

/// The tree, with its tiles above the level active: the mesher passes over the sides of others.
openvdb::FloatTree::ConstPtr with_active_solids(const openvdb::FloatGrid& occupancy, double level) {
  const auto solid_but_inactive = [&](const auto& tile) {
    return tile.isTileValue() && double{tile.getValue()} >= level;
  };
  bool any = false;
  auto tile = occupancy.tree().cbeginValueOff();
  tile.setMaxDepth(openvdb::FloatTree::ValueOffCIter::LEAF_DEPTH - 1);
  for (; tile && !any; ++tile) any = solid_but_inactive(tile);
  if (!any) return occupancy.constTreePtr();

  auto tree = std::make_shared<openvdb::FloatTree>(occupancy.tree());
  auto own = tree->beginValueOff();
  own.setMaxDepth(openvdb::FloatTree::ValueOffIter::LEAF_DEPTH - 1);
  for (; own; ++own)
    if (solid_but_inactive(own)) own.setActiveState(true);
  return tree;
}

/// The mesher's answer in places relative to the voxel `origin`, which keeps its float32 coordinates small.
Quads mesh_quads(const openvdb::FloatTree::ConstPtr& tree, const openvdb::Coord& origin, double level) {
  // Its own class and transform, but the tree is shared and never written.
  const auto grid = openvdb::FloatGrid::create(openvdb::ConstPtrCast<openvdb::FloatTree>(tree));
  const openvdb::math::Transform::Ptr transform = openvdb::math::Transform::createLinearTransform(1.0);
  transform->postTranslate(-origin.asVec3d());
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);  // larger is inside

  std::vector<openvdb::Vec3s> points;
  Quads quads;
  openvdb::tools::volumeToMesh(*grid, points, quads.corners, level);
  quads.places.reserve(points.size());
  const auto place = [](float voxels) { return std::llround(kPlacesPerVoxel * double{voxels}); };
  for (const openvdb::Vec3s& p : points) quads.places.emplace_back(place(p.x()), place(p.y()), place(p.z()));
  return quads;
}

/// Makes one vertex of all at the same place: number of the first of them, [n_places].
std::vector<std::uint32_t> first_at_place(const std::vector<Place>& places) {
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const Place &p = places[a], &q = places[b];
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z != q.z ? p.z < q.z : a < b;
  };
  std::vector<std::uint32_t> order(places.size()), first(places.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), before);
  for (std::size_t n = 0; n < order.size(); ++n)
    first[order[n]] = n > 0 && places[order[n]] == places[order[n - 1]] ? first[order[n - 1]] : order[n];
  return first;
}

/// Four times the square of the area, in places.
double squared_area(const Place& a, const Place& b, const Place& c) {
  const glm::dvec3 normal = glm::cross(glm::dvec3(b - a), glm::dvec3(c - a));
  return glm::dot(normal, normal);
}

/// The two halves of a quad, cut so that the smaller one is as large as can be.
std::array<glm::uvec3, 2> halves(const std::array<std::uint32_t, 4>& q, const std::vector<Place>& places) {
  const std::array<glm::uvec3, 2> along_02 = {{{q[0], q[1], q[2]}, {q[0], q[2], q[3]}}};
  const std::array<glm::uvec3, 2> along_13 = {{{q[0], q[1], q[3]}, {q[1], q[2], q[3]}}};
  const auto smaller = [&](const std::array<glm::uvec3, 2>& cut) {
    const auto area = [&](const glm::uvec3& t) { return squared_area(places[t.x], places[t.y], places[t.z]); };
    return std::min(area(cut[0]), area(cut[1]));
  };
  return smaller(along_02) >= smaller(along_13) ? along_02 : along_13;
}

std::vector<glm::uvec3> triangles_of(const Quads& quads) {
  const std::vector<std::uint32_t> first = first_at_place(quads.places);
  std::vector<glm::uvec3> triangles;
  triangles.reserve(2 * quads.corners.size());
  for (const openvdb::Vec4I& corners : quads.corners) {
    // OpenVDB's are clockwise.
    const std::array<std::uint32_t, 4> q = {first[corners[3]], first[corners[2]], first[corners[1]], first[corners[0]]};
    for (const glm::uvec3& t : halves(q, quads.places))
      if (squared_area(quads.places[t.x], quads.places[t.y], quads.places[t.z]) > 0.0) triangles.push_back(t);
  }
  return triangles;
}

}  // namespace

SurfaceMesh level_surface(const openvdb::FloatGrid& occupancy, double level) {
  SurfaceMesh mesh;
  const openvdb::FloatTree::ConstPtr tree = with_active_solids(occupancy, level);
  openvdb::CoordBBox box;
  if (!tree->evalLeafBoundingBox(box)) return mesh;  // neither leaves nor tiles
  Quads quads;
  try {
    quads = mesh_quads(tree, box.min(), level);
  } catch (const openvdb::ValueError&) {
    throw NumericsError("the surface of an occupancy: expected finite values, found others; the field has diverged");
  } catch (const openvdb::Exception& failure) {
    throw Error(std::string("the surface of an occupancy: OpenVDB failed: ") + failure.what());
  }
  mesh.triangles = triangles_of(quads);

  // Vertices are numbered anew as triangles name them first, as readers that weld do.
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> number(quads.places.size(), kUnused);
  for (glm::uvec3& t : mesh.triangles) {
    for (int n = 0; n < 3; ++n) {
      std::uint32_t& own = number[t[n]];
      if (own == kUnused) {
        own = static_cast<std::uint32_t>(mesh.vertices_m.size());
        const glm::dvec3 place = glm::dvec3(quads.places[t[n]]) / kPlacesPerVoxel;
        const openvdb::Vec3d world =
            occupancy.transform().indexToWorld(box.min().asVec3d() + openvdb::Vec3d(place.x, place.y, place.z));
        mesh.vertices_m.emplace_back(world.x(), world.y(), world.z());
      }
      t[n] = own;
    }
  }
  return mesh;
}

}  // namespace sarnerf
