// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>

#include "catch.h"
#include "files.h"
#include "readers/readers.h"
#include "solids.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A pyramid whose floor is a square: five vertices, five faces, six triangles.
constexpr std::array<std::array<double, 3>, 5> kPoints = {
    {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0.5, 2, 0.5}}};
const std::vector<std::vector<int>> kFaces = {
    {0, 1, 2, 3}, {4, 1, 0}, {4, 2, 1}, {4, 3, 2}, {4, 0, 3}};
constexpr double kVolume = 2.0 / 3.0;

void check_pyramid(const Scene& scene) {
  CHECK(scene.mesh.triangles.size() == 6);
  CHECK(scene.mesh.vertices_m.size() == 5);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(signed_volume(scene, 0) == Approx(kVolume));
}

template <class T>
void append(std::string& bytes, T value, bool big_endian) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  if (big_endian) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

std::string binary_ply(bool big_endian) {
  std::string ply = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                    "_endian 1.0\ncomment extra properties and elements are passed over\n"
                    "element camera 1\nproperty list uchar double pose\n"
                    "element vertex 5\nproperty double x\nproperty double y\nproperty double z\n"
                    "property uchar red\nproperty list ushort short tags\n"
                    "element face 5\nproperty list uchar uint vertex_indices\nproperty uchar mat\n"
                    "end_header\n";
  append(ply, std::uint8_t{2}, big_endian);
  append(ply, 1.5, big_endian);
  append(ply, 2.5, big_endian);
  for (const auto& p : kPoints) {
    for (const double x : p) append(ply, x, big_endian);
    append(ply, std::uint8_t{200}, big_endian);
    append(ply, std::uint16_t{1}, big_endian);
    append(ply, std::int16_t{-7}, big_endian);
  }
  for (const auto& face : kFaces) {
    append(ply, static_cast<std::uint8_t>(face.size()), big_endian);
    for (const int v : face) append(ply, static_cast<std::uint32_t>(v), big_endian);
    append(ply, static_cast<std::uint8_t>(face.size()), big_endian);
  }
  return ply;
}

std::string binary_stl() {
  std::string stl(80, '\0');
  stl.replace(0, 5, "solid");  // as some programs do
  append(stl, std::uint32_t{6}, false);
  const std::array<std::array<int, 3>, 6> triangles = {
      {{0, 1, 2}, {0, 2, 3}, {4, 1, 0}, {4, 2, 1}, {4, 3, 2}, {4, 0, 3}}};
  for (const auto& t : triangles) {
    for (int n = 0; n < 3; ++n) append(stl, 0.0f, false);
    for (const int v : t) {
      for (const double x : kPoints[static_cast<std::size_t>(v)])
        append(stl, static_cast<float>(x), false);
    }
    append(stl, std::uint16_t{0}, false);
  }
  return stl;
}

}  // namespace

TEST_CASE("OBJ: groups, materials, polygons, negative indices, continued lines") {
  const Scene scene =
      load_text("p.obj",
                "# pyramid\r\nmtllib none.mtl\no thing\n"
                "v 0 0 0 1.0\nv 1 0 0\nv 1 0 1\nv 0 0 +1\nv 5e-1 2. .5 0.1 0.2 0.3\n"
                "vn 0 1 0\nvt 0 0\nusemtl brick\nf 1/1/1 2//1 3/1 4\n"
                "g side left\nusemtl no such thing\nf -1 2 \\\n 1\nf 5 3 2\n"
                "g\nf 5 4 3 # comment\nf 5 1 4\nl 1 2\n");
  check_pyramid(scene);
  CHECK(scene.groups == std::vector<std::string>{"thing", "side left"});
  REQUIRE(scene.materials.size() == 2);
  CHECK(scene.materials[0].name == "brick");
  CHECK(scene.materials[1].name == "default");
  CHECK(has_line(scene.report.notes, "no such thing"));
}

TEST_CASE("PLY: ASCII and both byte orders, face ids") {
  check_pyramid(load_text("p.ply", binary_ply(false)));
  check_pyramid(load_text("p.ply", binary_ply(true)));
  check_pyramid(
      load_text("p.PLY",
                "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                "property float z\nelement face 5\nproperty list uchar int vertex_index\n"
                "end_header\n0 0 0\n1 0 0\n1 0 1\n0 0 1\n.5 2 .5\n"
                "4 0 1 2 3\n3 4 1 0\n3 4 2 1 3 4 3 2\n3 4 0 3"));

  const ScratchFolder folder;
  folder.write("p.ply", binary_ply(false));
  const Scene scene = load_scene(folder.write("s.json", R"({"format": "sarnerf-scene", "version": 1,
                                 "meshes": [{"file": "p.ply", "materials": {"4": "grass", "3": "metal"}}]})"),
                                 {});
  REQUIRE(scene.materials.size() == 2);
  CHECK(scene.materials[0].name == "grass");
  CHECK(scene.materials[1].name == "metal");
  CHECK(scene.mesh.material == std::vector<std::uint32_t>{0, 0, 1, 1, 1, 1});

  // An id is a name like any other, -1 too, and first in the file.
  folder.write("n.ply", "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                        "property float z\nelement face 5\nproperty list uchar int vertex_index\nproperty int material_id\n"
                        "end_header\n0 0 0\n1 0 0\n1 0 1\n0 0 1\n.5 2 .5\n"
                        "4 0 1 2 3 -1\n3 4 1 0 -1\n3 4 2 1 2\n3 4 3 2 2\n3 4 0 3 -1");
  const Scene negative = load_scene(folder.write("n.json", R"({"format": "sarnerf-scene", "version": 1,
                                    "meshes": [{"file": "n.ply", "materials": {"-1": "grass", "2": "metal"}}]})"), {});
  REQUIRE(negative.materials.size() == 2);
  CHECK(negative.mesh.material == std::vector<std::uint32_t>{0, 0, 0, 1, 1, 0});
}

TEST_CASE("STL: binary and ASCII") {
  check_pyramid(load_text("p.stl", binary_stl()));
  std::string ascii = "solid left side\n";
  for (const auto& t :
       {std::array{0, 1, 2}, {0, 2, 3}, {4, 1, 0}, {4, 2, 1}, {4, 3, 2}, {4, 0, 3}}) {
    ascii += " facet normal 0 0 0\n  outer loop\n";
    for (const int v : t) {
      const auto& p = kPoints[static_cast<std::size_t>(v)];
      ascii += "   vertex " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " +
               std::to_string(p[2]) + "\n";
    }
    ascii += "  endloop\n endfacet\n";
  }
  const Scene scene = load_text("p.stl", ascii + "endsolid\n");
  check_pyramid(scene);
  CHECK(scene.groups == std::vector<std::string>{"left side"});
}

TEST_CASE("OFF: comments, counts on the first line, colours") {
  check_pyramid(load_text("p.off",
                          "# comment\nOFF 5 5 0\n0 0 0\n1 0 0\n\n1 0 1\n0 0 1 # here too\n.5 2 .5\n"
                          "4 0 1 2 3 255 0 0\n3 4 1 0\n3 4 2 1\n3 4 3 2\n3 4 0 3\n"));
  check_pyramid(
      load_text("p.off",
                "COFF\n5 5 0\n0 0 0 9 9 9 9\n1 0 0 9 9 9 9\n1 0 1 9 9 9 9\n0 0 1 9 9 9 9\n"
                ".5 2 .5 9 9 9 9\n4 0 1 2 3\n3 4 1 0\n3 4 2 1\n3 4 3 2\n3 4 0 3\n"));
}

TEST_CASE("Concave polygons keep their area, whichever way they look") {
  // An L, a comb, and a star; areas by the shoelace formula.
  const std::vector<std::vector<glm::dvec2>> outlines = {
      {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 4}, {0, 4}},
      {{0, 0},
       {7, 0},
       {7, 3},
       {6, 3},
       {6, 1},
       {4, 1},
       {4, 3},
       {3, 3},
       {3, 1},
       {1, 1},
       {1, 3},
       {0, 3}},
      {{0, 3},
       {-0.7, 1},
       {-3, 1},
       {-1.1, -0.3},
       {-1.8, -2.5},
       {0, -1.2},
       {1.8, -2.5},
       {1.1, -0.3},
       {3, 1},
       {0.7, 1}},
      {{0, 0}, {1, 0}, {2, 0}, {2, 2}, {2, 3}, {0, 3}}};  // corners on a line
  for (const auto& outline : outlines) {
    double shoelace = 0.0;
    for (std::size_t n = 0; n < outline.size(); ++n) {
      const glm::dvec2 p = outline[n], q = outline[(n + 1) % outline.size()];
      shoelace += 0.5 * (p.x * q.y - p.y * q.x);
    }
    for (const bool reversed : {false, true}) {
      for (int axis = 0; axis < 3; ++axis) {
        ObjBuilder obj;
        std::string face = "f";
        for (std::size_t n = 0; n < outline.size(); ++n) {
          const glm::dvec2 p = outline[reversed ? outline.size() - 1 - n : n];
          glm::dvec3 v(0.3 * p.x + 0.2 * p.y);
          v[(axis + 1) % 3] = p.x;
          v[(axis + 2) % 3] = p.y;
          face += " " + std::to_string(obj.vertex(v));
        }
        obj.line(face);
        const Scene scene = load_text("p.obj", obj.text());
        // The plane leans: its area is larger than the outline's by 1 / cos.
        const double lean = glm::length(glm::dvec3(1.0, 0.3, 0.2));
        CHECK(area(scene) == Approx(std::abs(shoelace) * lean));
        CHECK(scene.report.warnings.empty());
        for (const glm::uvec3& t : scene.mesh.triangles) {
          const glm::dvec3 a = scene.mesh.vertices_m[t.x];
          const glm::dvec3 normal =
              glm::cross(scene.mesh.vertices_m[t.y] - a, scene.mesh.vertices_m[t.z] - a);
          CHECK((normal[axis] > 0.0) != reversed);
        }
      }
    }
  }
}

TEST_CASE("Polygons of as many corners as are cut: a spiral keeps its area, a hostile one ends") {
  // A spiral's ears lie at its ends only. Corners that go round a triangle again and again, and then round a
  // smaller one within it, have no ear at all: each must be asked once and not again after every cut.
  constexpr int kCorners = 4096;
  ObjBuilder spiral;
  std::string face = "f";
  std::vector<glm::dvec2> outline;
  for (int n = 0; n < kCorners; ++n) {
    const bool out = n < kCorners / 2;
    const double angle_rad = 0.1 * (out ? n : kCorners - 1 - n);
    const double radius = 1.0 + 0.2 * angle_rad + (out ? 0.0 : 0.05);
    outline.emplace_back(radius * std::cos(angle_rad), radius * std::sin(angle_rad));
    face += " " + std::to_string(spiral.vertex({outline.back().y, 0.0, outline.back().x}));
  }
  spiral.line(face);
  double shoelace = 0.0;
  for (int n = 0; n < kCorners; ++n) {
    const glm::dvec2 p = outline[static_cast<std::size_t>(n)];
    const glm::dvec2 q = outline[static_cast<std::size_t>((n + 1) % kCorners)];
    shoelace += 0.5 * (p.x * q.y - p.y * q.x);
  }
  CHECK(area(load_text("spiral.obj", spiral.text())) == Approx(std::abs(shoelace)));

  std::string hostile = "v 0 0 0\nv 4 0 0\nv 0 0 4\nv 1 0 1\nv 1 0 1.5\nv 1.5 0 1\n";
  for (int f = 0; f < 8; ++f) {
    hostile += "f";
    for (int n = 0; n < kCorners; ++n) hostile += n < kCorners / 2 ? " " + std::to_string(1 + n % 3) : " " + std::to_string(4 + n % 3);
    hostile += "\n";
  }
  CHECK_FALSE(load_text("hostile.obj", hostile).mesh.triangles.empty());
}

TEST_CASE("A polygon that crosses itself is cut, and reported where no correct cut is left") {
  const Scene scene =
      load_text("bow.obj", "v 0 0 0\nv 1 0 1\nv 1 0 0\nv 0 0 1.5\nv 3 0 0.1\nf 1 2 3 4 5\n");
  CHECK(scene.mesh.triangles.size() == 3);
  const Scene knot = load_text("knot.obj", "v 3 0 3\nv 2 0 0\nv 1 0 0\nv 4 0 1\nv 4 0 2\nv 0 0 3\nf 1 2 3 4 5 6\n");
  CHECK(has_line(knot.report.warnings, "1 polygon crosses its own outline"));
}

TEST_CASE("UTM coordinates lose nothing") {
  const glm::dvec3 origin(500'123.4567890123, 120.25, 4'812'345.678901234);
  ObjBuilder obj;
  obj.cube(origin, 0.001);
  const Scene scene = load_text("utm.obj", obj.text());
  REQUIRE(scene.mesh.vertices_m.size() == 8);
  CHECK(scene.box.min == origin);
  CHECK(scene.pieces[0].closed);
  bool corner_found = false;
  for (const glm::dvec3& v : scene.mesh.vertices_m)
    corner_found |= v == cube_corner(6, origin, 0.001);
  CHECK(corner_found);
}
