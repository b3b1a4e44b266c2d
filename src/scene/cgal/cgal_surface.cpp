// SPDX-License-Identifier: Apache-2.0
// All uses of CGAL in scene: orientation of triangles, inside-outside tests and distances to surfaces. They are in one
// translation unit because CGAL's headers take as long to compile as the rest of scene.
#include "cgal/cgal_surface.h"

#include <array>
#include <string>
#include <variant>

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include "sarnerf/core/error.h"
#include "sarnerf/scene/surface_distance.h"

namespace sarnerf {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polygons = std::vector<std::array<std::size_t, 3>>;
using CgalMesh = CGAL::Surface_mesh<Point>;
using Face = CgalMesh::Face_index;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<CgalMesh>>>;
using SideTest = CGAL::Side_of_triangle_mesh<CgalMesh, Kernel, CGAL::Default, Tree>;

Point point_of(const glm::dvec3& p) { return {p.x, p.y, p.z}; }
glm::dvec3 vector_of(const Point& p) { return {p.x(), p.y(), p.z()}; }

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

/// Runs `work` and turns exceptions of CGAL into InputError.
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
  CgalMesh surface;
  Tree tree;
  std::unique_ptr<SideTest> side;  ///< null where no face has area: then nothing is inside

  /// Faces without area have no sides, and CGAL's rays must not be intersected with them.
  std::vector<Face> faces_with_area() const {
    std::vector<Face> faces;
    for (const Face face : surface.faces()) {
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
    state_->side = std::make_unique<SideTest>(state_->tree);
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

struct SurfaceDistance::State {
  CgalMesh surface;
  std::vector<std::uint32_t> triangle_of_face;
  std::vector<Face> face_of_triangle;
  std::vector<glm::dvec3> normal;  ///< per triangle
  Tree tree;
  std::unique_ptr<SideTest> side;

  NearestPoint result(const glm::dvec3& from, const Tree::Point_and_primitive_id& found) const {
    const glm::dvec3 q = vector_of(found.first);
    const double distance = glm::length(from - q);
    return {q, facing_triangle(from - q, distance, q, triangle_of_face[found.second], found.second),
            distance};
  }

  /// On an edge or a corner several triangles are nearest. Returns the one that faces the point most, and the
  /// first of several such, so that the result does not depend on rounding.
  std::uint32_t facing_triangle(const glm::dvec3& away, double distance, const glm::dvec3& q,
                                std::uint32_t own, Face face) const {
    // `away` is perpendicular to the triangle: q lies inside the triangle, or nearly so.
    if (std::abs(glm::dot(away, normal[own])) > (1.0 - 1e-9) * distance) return own;
    constexpr double kAlike = 1e-6;
    const double tolerance = 1e-6 * distance;
    std::uint32_t best = own;
    double most = std::abs(glm::dot(away, normal[own]));
    const auto consider = [&](Face other) {
      if (other == CgalMesh::null_face()) return;
      const std::uint32_t triangle = triangle_of_face[other];
      const double facing = std::abs(glm::dot(away, normal[triangle]));
      const bool alike = std::abs(facing - most) <= kAlike * distance;
      if (alike ? triangle < best : facing > most) best = triangle;
      if (!alike && facing > most) most = facing;
    };
    for (const auto h : surface.halfedges_around_face(surface.halfedge(face))) {
      const glm::dvec3 a = vector_of(surface.point(surface.source(h)));
      const glm::dvec3 b = vector_of(surface.point(surface.target(h)));
      if (glm::length(b - q) <= tolerance) {
        for (const auto around : surface.halfedges_around_target(h)) consider(surface.face(around));
      } else if (glm::length(glm::cross(b - a, q - a)) <= tolerance * glm::length(b - a)) {
        consider(surface.face(surface.opposite(h)));
      }
    }
    return best;
  }
};

SurfaceDistance::SurfaceDistance(std::span<const glm::dvec3> vertices_m,
                                 std::span<const glm::uvec3> triangles, bool closed)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.normal.assign(triangles.size(), glm::dvec3(0.0));
  s.face_of_triangle.assign(triangles.size(), CgalMesh::null_face());
  // Distances need no connectivity between triangles. Inside tests of closed pieces do, and after repair these
  // have no edge with three faces.
  std::vector<CgalMesh::Vertex_index> vertex;
  vertex.reserve(vertices_m.size());
  for (const glm::dvec3& v : vertices_m) vertex.push_back(s.surface.add_vertex(point_of(v)));
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const glm::uvec3& c = triangles[t];
    const glm::dvec3 area =
        glm::cross(vertices_m[c.y] - vertices_m[c.x], vertices_m[c.z] - vertices_m[c.x]);
    const double length = glm::length(area);
    if (!(length > 0.0)) continue;
    s.normal[t] = area / length;
    Face face = s.surface.add_face(vertex[c.x], vertex[c.y], vertex[c.z]);
    if (face == CgalMesh::null_face()) {
      // The surface is pinched at these corners: the triangle gets vertices of its own.
      face = s.surface.add_face(s.surface.add_vertex(point_of(vertices_m[c.x])),
                                s.surface.add_vertex(point_of(vertices_m[c.y])),
                                s.surface.add_vertex(point_of(vertices_m[c.z])));
    }
    s.face_of_triangle[t] = face;
    s.triangle_of_face.push_back(t);
  }
  if (s.triangle_of_face.empty()) {
    throw InputError("a piece of the mesh has no area: expected at least one proper triangle");
  }
  s.tree.insert(s.surface.faces().begin(), s.surface.faces().end(), s.surface);
  s.tree.build();
  s.tree.accelerate_distance_queries();
  if (closed) s.side = std::make_unique<SideTest>(s.tree);
}

SurfaceDistance::~SurfaceDistance() = default;

NearestPoint SurfaceDistance::nearest(const glm::dvec3& point_m) const {
  return state_->result(point_m, state_->tree.closest_point_and_primitive(point_of(point_m)));
}

NearestPoint SurfaceDistance::nearest(const glm::dvec3& point_m, const NearestPoint& hint) const {
  const State& s = *state_;
  return s.result(point_m, s.tree.closest_point_and_primitive(
                               point_of(point_m), Tree::Point_and_primitive_id(
                                                      point_of(hint.point_m),
                                                      s.face_of_triangle[hint.triangle])));
}

bool SurfaceDistance::holds(const glm::dvec3& point_m, const NearestPoint& nearest) const {
  const State& s = *state_;
  if (!s.side) return false;
  const glm::dvec3 away = point_m - nearest.point_m;
  const double above = glm::dot(away, s.normal[nearest.triangle]);
  // `away` is perpendicular to the triangle within rounding: the nearest point lies inside it.
  if (std::abs(above) > (1.0 - 1e-9) * nearest.distance_m) return above < 0.0;
  return (*s.side)(point_of(point_m)) == CGAL::ON_BOUNDED_SIDE;
}

std::optional<FreePath> SurfaceDistance::free_path(const glm::dvec3& from_m, const glm::dvec3& direction,
                                                   std::uint32_t from) const {
  const State& s = *state_;
  const Kernel::Ray_3 ray(point_of(from_m),
                          Kernel::Vector_3(direction.x, direction.y, direction.z));
  const Face own = s.face_of_triangle[from];
  const auto found = s.tree.first_intersection(ray, [own](const Face& f) { return f == own; });
  if (!found) return std::nullopt;
  // The intersection with a triangle seen edge-on is a segment.
#if CGAL_VERSION_NR >= CGAL_VERSION_NUMBER(6, 0, 0)
  const auto* point = std::get_if<Point>(&found->first);
#else
  const auto* point = boost::get<Point>(&found->first);
#endif
  return FreePath{point ? glm::length(vector_of(*point) - from_m) : 0.0, s.triangle_of_face[found->second]};
}

bool SurfaceDistance::meets_any(const glm::dvec3& from_m, const glm::dvec3& direction) const {
  return state_->tree.do_intersect(
      Kernel::Ray_3(point_of(from_m), Kernel::Vector_3(direction.x, direction.y, direction.z)));
}

glm::dvec3 SurfaceDistance::normal(std::uint32_t triangle) const {
  return state_->normal[triangle];
}

}  // namespace sarnerf
