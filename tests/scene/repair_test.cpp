// SPDX-License-Identifier: Apache-2.0
#include "catch.h"
#include "files.h"
#include "solids.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Scene load(const ObjBuilder& obj, const LoadOptions& options = {}) {
  return load_text("m.obj", obj.text(), options);
}

int n_closed(const Scene& scene) {
  int count = 0;
  for (const Piece& piece : scene.pieces) count += piece.closed ? 1 : 0;
  return count;
}

}  // namespace

TEST_CASE("A good cube is left alone") {
  ObjBuilder obj;
  obj.cube({1, 2, 3}, 2.0);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(signed_volume(scene, 0) == Approx(8.0));
  CHECK(scene.report.notes.empty());
  CHECK(scene.report.warnings.empty());
  CHECK(scene.box.min == glm::dvec3(1, 2, 3));
  CHECK(scene.box.max == glm::dvec3(3, 4, 5));
}

TEST_CASE("Four vertices where twelve media meet become twelve solids") {
  ObjBuilder obj;
  obj.vertex({0, 0, 0});
  obj.vertex({1, 0, 0});
  obj.vertex({0, 1, 0});
  obj.vertex({0, 0, 1});
  std::string media;
  for (int n = 0; n < 12; ++n) {
    const std::string name = "m" + std::to_string(n);
    media += (n == 0 ? "\"" : ",\"") + name + "\":{\"extinction_per_m\":1}";
    obj.line("usemtl " + name);
    obj.triangle(1, 3, 2);
    obj.triangle(1, 2, 4);
    obj.triangle(2, 3, 4);
    obj.triangle(3, 1, 4);
  }
  const ScratchFolder folder;
  LoadOptions options;
  options.materials_file =
      folder.write("m.json", R"({"format":"sarnerf-materials","version":1,"materials":{)" + media + "}}");
  const Scene scene = load(obj, options);
  CHECK(scene.pieces.size() == 12);
  CHECK(n_closed(scene) == 12);
  CHECK(scene.mesh.vertices_m.size() == 48);
}

TEST_CASE("A cavity is found behind a face without area") {
  // A corner halfway along an edge, which the face beyond does not have: a triangle without area joins them.
  ObjBuilder obj;
  for (int n = 0; n < 8; ++n) obj.vertex(cube_corner(n, {0, 0, 0}, 4.0));
  const auto corners = kCubeFaces[0];
  const int a = corners[0] + 1, b = corners[1] + 1, c = corners[2] + 1;
  const int middle =
      obj.vertex(0.5 * (cube_corner(a - 1, {0, 0, 0}, 4.0) + cube_corner(b - 1, {0, 0, 0}, 4.0)));
  obj.triangle(a, middle, c);
  obj.triangle(middle, b, c);
  obj.triangle(a, b, middle);
  for (std::size_t f = 1; f < kCubeFaces.size(); ++f) {
    obj.triangle(kCubeFaces[f][0] + 1, kCubeFaces[f][1] + 1, kCubeFaces[f][2] + 1);
  }
  obj.cube({1, 1, 1}, 2.0, true);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(signed_volume(scene, 0) == Approx(64.0 - 8.0));
  CHECK(has_line(scene.report.notes, "so a cavity"));
}

TEST_CASE("An inverted cube is turned outward") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 2.0, true);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(signed_volume(scene, 0) == Approx(8.0));
  CHECK(scene.report.notes == std::vector<std::string>{"turned 1 piece outward"});
}

TEST_CASE("Faces that disagree are turned") {
  ObjBuilder obj;
  for (int n = 0; n < 8; ++n) obj.vertex(cube_corner(n, {0, 0, 0}, 2.0));
  for (std::size_t f = 0; f < kCubeFaces.size(); ++f) {
    const bool flip = f == 2 || f == 7 || f == 8;
    obj.triangle(1 + kCubeFaces[f][0], 1 + kCubeFaces[f][flip ? 2 : 1],
                 1 + kCubeFaces[f][flip ? 1 : 2]);
  }
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(signed_volume(scene, 0) == Approx(8.0));
  CHECK(has_line(scene.report.notes, "turned 3 faces to agree"));
}

TEST_CASE("A cube of separate triangles is welded") {
  ObjBuilder obj;
  obj.split_cube({0, 0, 0}, 2.0);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(scene.mesh.vertices_m.size() == 8);
  CHECK(scene.report.notes == std::vector<std::string>{"merged 28 duplicate vertices"});
}

TEST_CASE("Gaps of rounding are closed, real gaps are not") {
  const auto shaken_cube = [](double shake) {
    ObjBuilder obj;
    int n = 0;
    for (const auto& f : kCubeFaces) {
      std::array<int, 3> corners;
      for (std::size_t c = 0; c < 3; ++c) {
        const glm::dvec3 off(n % 3 - 1, n % 5 - 2, n % 7 - 3);
        ++n;
        corners[c] = obj.vertex(cube_corner(f[c], {500'000, 0, -4'000'000}, 2.0) + shake * off);
      }
      obj.triangle(corners[0], corners[1], corners[2]);
    }
    return load(obj);
  };
  const Scene closed = shaken_cube(1e-7);
  REQUIRE(closed.pieces.size() == 1);
  CHECK(closed.pieces[0].closed);
  CHECK(closed.mesh.vertices_m.size() == 8);
  CHECK(signed_volume(closed, 0) == Approx(8.0));
  CHECK(has_line(closed.report.notes, "joined 28 vertices of open borders"));
  CHECK(n_closed(shaken_cube(1e-3)) == 0);
}

TEST_CASE("Zeros of both signs are one place") {
  const Scene scene = load_text("z.obj",
                                "v 0 0 0\nv 1 0 0\nv 0 0 1\nv -0.0 0 -0.0\nv 0 1 0\nv 1 -0.0 0\n"
                                "f 1 2 3\nf 4 5 6\n");
  CHECK(scene.mesh.vertices_m.size() == 4);
  CHECK(scene.pieces.size() == 1);
}

TEST_CASE("Duplicate and degenerate faces go, in number") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 2.0);
  obj.triangle(1, 2, 3);  // again
  obj.triangle(3, 1, 2);  // and again, begun elsewhere
  obj.triangle(4, 3, 1);  // one face of the cube from its back: a sheet drawn from both sides
  obj.triangle(5, 5, 6);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(scene.mesh.triangles.size() == 12);
  CHECK(signed_volume(scene, 0) == Approx(8.0));
  CHECK(has_line(scene.report.notes, "dropped 3 duplicate faces"));
  CHECK(has_line(scene.report.notes, "dropped 1 face with fewer than three different corners"));
}

TEST_CASE("Faces without area hold a solid together until the end") {
  // One edge of the cube has a vertex in its middle, on one side only; a flat face fills the gap.
  ObjBuilder obj;
  for (int n = 0; n < 8; ++n) obj.vertex(cube_corner(n, {0, 0, 0}, 2.0));
  const int middle = obj.vertex({1, 0, 2});  // between vertices 3 (2,0,2) and 4 (0,0,2)
  for (const auto& f : kCubeFaces) {
    if (f == std::array{3, 2, 6}) {
      obj.triangle(4, middle, 7);
      obj.triangle(middle, 3, 7);
    } else {
      obj.triangle(1 + f[0], 1 + f[1], 1 + f[2]);
    }
  }
  obj.triangle(4, 3, middle);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(scene.mesh.triangles.size() == 13);
  CHECK(has_line(scene.report.notes, "dropped 1 face without area"));
}

TEST_CASE("Open sheets are thin shells, never dropped") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 1.0);
  const int first = obj.vertex({5, 0, 0});
  obj.vertex({6, 0, 0});
  obj.vertex({6, 1, 0});
  obj.vertex({5, 1, 0});
  obj.triangle(first, first + 1, first + 2);
  obj.triangle(first, first + 2, first + 3);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 2);
  CHECK(scene.pieces[0].closed);
  CHECK_FALSE(scene.pieces[1].closed);
  CHECK(scene.report.notes ==
        std::vector<std::string>{"2 faces in 1 open piece are treated as thin shells"});
}

TEST_CASE("A sheet drawn from both sides keeps one of them") {
  const Scene scene = load_text("s.obj",
                                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                "f 1 2 3\nf 1 3 4\nf 3 2 1\nf 4 3 1\n");
  CHECK(scene.mesh.triangles.size() == 2);
  REQUIRE(scene.pieces.size() == 1);
  CHECK_FALSE(scene.pieces[0].closed);
}

TEST_CASE("A sheet folded onto itself encloses nothing") {
  // The two sides are cut along different diagonals, so no face is a duplicate.
  const Scene scene = load_text("s.obj",
                                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                "f 1 2 3\nf 1 3 4\nf 4 2 1\nf 4 3 2\n");
  REQUIRE(scene.pieces.size() == 1);
  CHECK_FALSE(scene.pieces[0].closed);
}

TEST_CASE("A fin on a cube: the cube stays a solid, the fin is a shell") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 2.0);
  const int tip = obj.vertex({3, 3, -1});
  obj.triangle(5, 6, tip);  // on a top edge: three faces meet there
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 2);
  CHECK(n_closed(scene) == 1);
  CHECK(scene.mesh.triangles.size() == 13);
  CHECK(has_line(scene.report.notes, "split 1 edge shared by more than two faces"));
  for (std::uint32_t p = 0; p < 2; ++p) {
    if (scene.pieces[p].closed) CHECK(signed_volume(scene, p) == Approx(8.0));
  }
}

TEST_CASE("Cubes that share an edge are two solids") {
  ObjBuilder obj;
  obj.split_cube({0, 0, 0}, 1.0);
  obj.split_cube({1, 1, 0}, 1.0);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 2);
  CHECK(n_closed(scene) == 2);
}

TEST_CASE("Cubes that share a wall become one solid") {
  ObjBuilder obj;
  obj.split_cube({0, 0, 0}, 1.0);
  // Mirrored in x, so that both cut the common wall along the same diagonal.
  for (const auto& f : kCubeFaces) {
    const auto corner = [&](int n) {
      const glm::dvec3 p = cube_corner(n, {0, 0, 0}, 1.0);
      return obj.vertex({2.0 - p.x, p.y, p.z});
    };
    const int a = corner(f[0]), c = corner(f[1]);
    obj.triangle(a, corner(f[2]), c);
  }
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(signed_volume(scene, 0) == Approx(2.0));
  CHECK(has_line(scene.report.notes, "dropped 4 faces inside"));
}

TEST_CASE("Solids of different media keep boundaries of their own where they touch") {
  const ScratchFolder folder;
  ObjBuilder obj;
  obj.line("usemtl brick");
  obj.cube({0, 0, 0}, 1.0);
  obj.line("usemtl hedge");
  obj.cube({0, 1, 0}, 1.0);
  const Scene scene = load_text("m.obj", obj.text());
  REQUIRE(scene.pieces.size() == 2);
  CHECK(n_closed(scene) == 2);
  CHECK(scene.mesh.triangles.size() == 24);
}

TEST_CASE("An open translucent piece is invisible, and that is said") {
  const Scene scene = load_text("m.obj", "usemtl canopy\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  CHECK(has_line(scene.report.warnings, "'canopy' bound no volume"));
}

TEST_CASE("Nested cubes: each its own solid, unless one was drawn as a cavity") {
  const auto nested = [](bool outer_inverted, bool inner_inverted) {
    ObjBuilder obj;
    obj.cube({0, 0, 0}, 4.0, outer_inverted);
    obj.cube({1, 1, 1}, 2.0, inner_inverted);
    return load(obj);
  };
  for (const auto& [outer, inner] :
       {std::pair(false, false), std::pair(true, true), std::pair(true, false)}) {
    const Scene solids = nested(outer, inner);
    REQUIRE(solids.pieces.size() == 2);
    CHECK(signed_volume(solids, 0) == Approx(64.0));
    CHECK(signed_volume(solids, 1) == Approx(8.0));
  }
  const Scene hollow = nested(false, true);
  REQUIRE(hollow.pieces.size() == 1);
  CHECK(hollow.pieces[0].closed);
  CHECK(signed_volume(hollow, 0) == Approx(56.0));
  CHECK(has_line(hollow.report.notes, "a cavity"));
}

TEST_CASE(
    "A solid within a cavity, and an inverted cube beside: only what lies inside is a cavity") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 10.0);
  obj.cube({1, 1, 1}, 8.0, true);
  obj.cube({3, 3, 3}, 2.0);
  obj.cube({20, 0, 0}, 1.0, true);
  const Scene scene = load(obj);
  REQUIRE(scene.pieces.size() == 3);
  CHECK(signed_volume(scene, 0) == Approx(1000.0 - 512.0));
  CHECK(signed_volume(scene, 1) == Approx(8.0));
  CHECK(signed_volume(scene, 2) == Approx(1.0));
}

TEST_CASE("A Möbius strip ends as a shell") {
  ObjBuilder obj;
  constexpr int n = 12;
  for (int k = 0; k < n; ++k) {
    const double a = 2.0 * 3.14159265358979 * k / n;
    for (const double w : {-0.5, 0.5}) {
      const double r = 3.0 + w * std::cos(a / 2);
      obj.vertex({r * std::cos(a), w * std::sin(a / 2), r * std::sin(a)});
    }
  }
  for (int k = 0; k < n; ++k) {
    const int a = 2 * k + 1, b = 2 * k + 2;
    const int c = k + 1 < n ? a + 2 : 2, d = k + 1 < n ? b + 2 : 1;
    obj.triangle(a, b, d);
    obj.triangle(a, d, c);
  }
  const Scene scene = load(obj);
  CHECK(scene.mesh.triangles.size() == 2 * n);
  CHECK(n_closed(scene) == 0);
}

TEST_CASE("Materials and groups stay with their faces") {
  ObjBuilder obj;
  for (int n = 0; n < 8; ++n) obj.vertex(cube_corner(n, {0, 0, 0}, 1.0));
  for (std::size_t f = 0; f < kCubeFaces.size(); ++f) {
    if (f % 2 == 0)
      obj.line("usemtl " + std::string(f < 4 ? "brick" : "metal") + "\ng part" +
               std::to_string(f / 2));
    const bool flip = f % 3 == 0;
    obj.triangle(1 + kCubeFaces[f][0], 1 + kCubeFaces[f][flip ? 2 : 1],
                 1 + kCubeFaces[f][flip ? 1 : 2]);
    if (f % 4 == 1) obj.triangle(1, 1, 2);
  }
  const Scene scene = load(obj);
  REQUIRE(scene.mesh.triangles.size() == 12);
  for (std::size_t t = 0; t < 12; ++t) {
    CHECK(scene.materials[scene.mesh.material[t]].name == (t < 4 ? "brick" : "metal"));
    CHECK(scene.groups[scene.mesh.group[t]] == "part" + std::to_string(t / 2));
    glm::dvec3 middle(0.0), expected(0.0);
    for (int c = 0; c < 3; ++c) {
      middle += scene.mesh.vertices_m[scene.mesh.triangles[t][c]];
      expected += cube_corner(kCubeFaces[t][static_cast<std::size_t>(c)], {0, 0, 0}, 1.0);
    }
    CHECK(middle == expected);
  }
}

TEST_CASE("Without repair, faces stay as they are") {
  LoadOptions as_drawn;
  as_drawn.repair = false;
  ObjBuilder obj;
  obj.split_cube({0, 0, 0}, 1.0);
  obj.cube({5, 0, 0}, 1.0, true);
  const int lonely = obj.vertex({9, 0, 0});
  obj.triangle(lonely, lonely, obj.vertex({9, 1, 0}));
  const Scene scene = load(obj, as_drawn);
  CHECK(scene.mesh.triangles.size() == 25);
  CHECK(n_closed(scene) == 1);
  CHECK(scene.pieces[0].closed);
  CHECK(signed_volume(scene, 0) == Approx(1.0));
  CHECK_FALSE(scene.pieces[1].closed);
}
