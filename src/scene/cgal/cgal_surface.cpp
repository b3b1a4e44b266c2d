// SPDX-License-Identifier: Apache-2.0
#include "cgal/cgal_surface.h"

#include <array>
#include <string>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polygons = std::vector<std::array<std::size_t, 3>>;

Point point_of(const glm::dvec3& p) { return {p.x, p.y, p.z}; }

std::vector<Point> points_of(std::span<const glm::dvec3> vertices) {
  std::vector<Point> points;
  points.reserve(vertices.size());
  for (const glm::dvec3& v : vertices) points.push_back(point_of(v));
  return points;
}

Polygons polygons_of(std::span<const glm::uvec3> triangles) {
  Polygons polygons;
  polygons.reserve(triangles.size());
  for (const glm::uvec3& t : triangles) polygons.push_back({t.x, t.y, t.z});
  return polygons;
}

/// CGAL reports what it did not expect by exceptions of its own.
template <class Work>
auto translated(Work work) {
  try {
    return work();
  } catch (const CGAL::Failure_exception& failure) {
    throw InputError(std::string("the mesh cannot be repaired (CGAL: ") + failure.message() +
                     "); export it again, or mend it where it was made");
  }
}

}  // namespace

void orient_with_cgal(std::vector<glm::dvec3>& vertices, std::vector<glm::uvec3>& triangles) {
  std::vector<Point> points = points_of(vertices);
  Polygons polygons = polygons_of(triangles);
  translated([&] { return CGAL::Polygon_mesh_processing::orient_polygon_soup(points, polygons); });
  for (std::size_t n = vertices.size(); n < points.size(); ++n) {
    vertices.emplace_back(points[n].x(), points[n].y(), points[n].z());
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    triangles[t] = {polygons[t][0], polygons[t][1], polygons[t][2]};
  }
}

bool on_one_line(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return CGAL::collinear(point_of(a), point_of(b), point_of(c));
}

struct SideOfSurface::State {
  using SurfaceMesh = CGAL::Surface_mesh<Point>;
  using Test = CGAL::Side_of_triangle_mesh<SurfaceMesh, Kernel>;
  SurfaceMesh surface;
  Test::AABB_tree tree;
  std::unique_ptr<Test> side;  ///< null where no face has area: then nothing is inside

  /// Faces without area have no sides, and CGAL's rays must not be asked to meet them.
  std::vector<SurfaceMesh::Face_index> faces_with_area() const {
    std::vector<SurfaceMesh::Face_index> faces;
    for (const SurfaceMesh::Face_index face : surface.faces()) {
      const auto edge = surface.halfedge(face);
      const Point &a = surface.point(surface.source(edge)), &b = surface.point(surface.target(edge)),
                  &c = surface.point(surface.target(surface.next(edge)));
      if (!CGAL::collinear(a, b, c)) faces.push_back(face);
    }
    return faces;
  }
};

SideOfSurface::SideOfSurface(std::span<const glm::dvec3> vertices,
                             std::span<const glm::uvec3> triangles)
    : state_(std::make_unique<State>()) {
  const std::vector<Point> points = points_of(vertices);
  const Polygons polygons = polygons_of(triangles);
  translated([&] {
    CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, polygons, state_->surface);
    const auto faces = state_->faces_with_area();
    if (faces.empty()) return 0;
    state_->tree.insert(faces.begin(), faces.end(), state_->surface);
    state_->tree.build();
    state_->side = std::make_unique<State::Test>(state_->tree);
    return 0;
  });
}

SideOfSurface::~SideOfSurface() = default;

Side SideOfSurface::of(const glm::dvec3& point) const {
  if (!state_->side) return Side::outside;
  const CGAL::Bounded_side side = translated([&] { return (*state_->side)(point_of(point)); });
  if (side == CGAL::ON_BOUNDED_SIDE) return Side::inside;
  return side == CGAL::ON_BOUNDARY ? Side::on_surface : Side::outside;
}

}  // namespace sarnerf
