// SPDX-License-Identifier: Apache-2.0
#include "winding.h"

#include <cmath>
#include <cstdint>
#include <numbers>

#include "catch.h"
#include "sarnerf/bake/score.h"
#include "sarnerf/core/parallel.h"
#include "solid_meshes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Box box_of(const SurfaceMesh& mesh) {
  Box box;
  for (const glm::uvec3& t : mesh.triangles)
    for (int corner = 0; corner < 3; ++corner) box.include(mesh.vertices_m[t[corner]]);
  return box;
}

/// The definition: signed solid angles of all triangles, over 4π.
double by_definition(const SurfaceMesh& mesh, const glm::dvec3& p) {
  double angle = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.x] - p, b = mesh.vertices_m[t.y] - p, c = mesh.vertices_m[t.z] - p;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    angle += 2.0 * std::atan2(glm::dot(a, glm::cross(b, c)),
                              la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return angle / (4.0 * std::numbers::pi);
}

/// Largest difference between both over a box.
double worst_difference(const SurfaceMesh& mesh, int n = 12) {
  double worst = 0.0;
  for (const WindingSample& sample : winding_samples(mesh, box_of(mesh), n))
    worst = worse(worst, std::abs(sample.winding - by_definition(mesh, sample.point_m)));
  return worst;
}

/// Without the triangles whose middle is higher than this along a direction.
SurfaceMesh cut(SurfaceMesh mesh, const glm::dvec3& direction, double height_m) {
  std::erase_if(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 middle = (mesh.vertices_m[t.x] + mesh.vertices_m[t.y] + mesh.vertices_m[t.z]) / 3.0;
    return glm::dot(middle, glm::normalize(direction)) > height_m;
  });
  return mesh;
}

/// Every n-th triangle turned.
SurfaceMesh turned(SurfaceMesh mesh, std::size_t n) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += n) std::swap(mesh.triangles[t].y, mesh.triangles[t].z);
  return mesh;
}

/// All that is not closed.
TruthSurface open_truth(const SurfaceMesh& mesh) { return {{}, mesh, 0, {}}; }

/// Columns of a 100th of a sphere of radius 1.
ScoreOptions quick_score() {
  ScoreOptions options;
  options.n_samples = 5000;
  options.column_spacing_m = 0.02;
  return options;
}

TruthVolumeChoice choice_of(const TruthSurface& truth) { return truth_volume(truth, quick_score()); }

SurfaceScore score_by_choice(const SurfaceMesh& extracted, const TruthSurface& truth) {
  ScoreOptions options = quick_score();
  options.truth_volume = choice_of(truth).volume;
  return score(extracted, truth, {}, options);
}

const SurfaceMesh kSphere = sphere_mesh({0, 0, 0}, 1.0, 4);

}  // namespace

TEST_CASE("a closed mesh winds once around what is inside and not around what is outside", "[winding]") {
  const SurfaceMesh cube = cube_mesh({-1, -1, -1}, 2.0);
  CHECK(BorderWinding(cube).empty());
  CHECK(BorderWinding(kSphere).empty());
  for (const WindingSample& sample : winding_samples(kSphere, box_of(kSphere), 16)) {
    const double radius_m = glm::length(sample.point_m);
    if (std::abs(radius_m - 1.0) < 0.01) continue;  // between the facets and the sphere
    CHECK(std::abs(sample.winding - (radius_m < 1.0 ? 1.0 : 0.0)) < 1e-6);
  }
  for (const WindingSample& sample : winding_samples(cube, {glm::dvec3(-2.0), glm::dvec3(2.0)}, 12)) {
    const bool inside = glm::all(glm::lessThan(glm::abs(sample.point_m), glm::dvec3(1.0)));
    CHECK(std::abs(sample.winding - (inside ? 1.0 : 0.0)) < 1e-6);
  }
  // The same triangles, none of which shares a vertex with another.
  SurfaceMesh soup;
  for (const glm::uvec3& t : cube.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices_m.size());
    for (int corner = 0; corner < 3; ++corner) soup.vertices_m.push_back(cube.vertices_m[t[corner]]);
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  CHECK(BorderWinding(soup).empty());
}

TEST_CASE("a cube without its lid winds by the solid angle of the lid", "[winding]") {
  SurfaceMesh open = cube_mesh({-1, -1, -1}, 2.0);
  open.triangles.erase(open.triangles.begin() + 6, open.triangles.begin() + 8);
  const BorderWinding border(open);
  CHECK(border.n_edges() == 4);
  // From the middle each of six faces is a sixth of the sphere. On the axis at distance d a square of half side 1 is
  // seen at 4 asin(1 / (1 + d²)).
  constexpr int kFloor = 1;  // is passed from below
  CHECK(kFloor + border.at(glm::dvec3(0.0)) == Approx(5.0 / 6.0));
  for (const double y : {-0.9, -0.5, 0.0, 0.4, 0.99}) {
    const double d = 1.0 - y, lid = 4.0 * std::asin(1.0 / (1.0 + d * d));
    CHECK(kFloor + border.at({0.0, y, 0.0}) == Approx(1.0 - lid / (4.0 * std::numbers::pi)).epsilon(1e-12));
  }
  CHECK(worst_difference(open) < 1e-12);
}

TEST_CASE("a disc winds by the solid angle of a cap", "[winding]") {
  // Normal up: half from below, minus a half from above, (1 − cos α) / 2 on its axis.
  constexpr int kCorners = 720;
  SurfaceMesh disc;
  disc.vertices_m.emplace_back(0.0);
  for (int n = 0; n < kCorners; ++n) {
    const double angle = 2.0 * std::numbers::pi * n / kCorners;
    disc.vertices_m.emplace_back(std::cos(angle), 0.0, -std::sin(angle));
    disc.triangles.emplace_back(0, n + 1, (n + 1) % kCorners + 1);
  }
  const BorderWinding border(disc);
  CHECK(border.n_edges() == kCorners);
  for (const double y : {-20.0, -2.0, -0.5, -0.01, 0.01, 0.5, 2.0, 20.0}) {
    const double part = 0.5 * (1.0 - std::abs(y) / std::hypot(1.0, y));
    const int turns = y > 0.0 ? -1 : 0;  // the disc below is passed downwards
    CHECK(turns + border.at({1e-4, y, 2e-4}) == Approx(y > 0.0 ? -part : part).margin(1e-4));
  }
}

TEST_CASE("winding numbers by the border are those of the definition", "[winding]") {
  const SurfaceMesh fine = sphere_mesh({0, 0, 0}, 1.0, 4);  // 5120 triangles
  CHECK(worst_difference(cut(fine, {0, 1, 0}, 0.8)) < 2e-3);
  CHECK(worst_difference(cut(fine, {1, -2, 0.5}, 0.5)) < 2e-3);
  CHECK(worst_difference(cut(cut(fine, {1, 0, 0}, 0.7), {0, -1, 0.2}, 0.4)) < 2e-3);
  CHECK(worst_difference(turned(fine, 9)) < 2e-3);
  SurfaceMesh all_over = fine;  // holes everywhere
  std::erase_if(all_over.triangles, [n = 0](const glm::uvec3&) mutable { return n++ % 7 == 0; });
  CHECK(BorderWinding(all_over).n_edges() > 2000);
  CHECK(worst_difference(all_over) < 2e-3);
  CHECK(worst_difference(joined(fine, moved(inverted(fine), {0.3, 0.1, 0.0}, 0.5))) < 1e-12);
}

TEST_CASE("a sphere with a cap cut off is closed by the flattest lid", "[winding]") {
  // Below the border's plane the missing cap is seen at less than half of the sphere, above it at more.
  for (const glm::dvec3 direction : {glm::dvec3(0, 1, 0), {1, 0, 0}, {1, -2, 0.5}}) {
    const SurfaceMesh open = cut(kSphere, direction, 0.9);  // 5 % of its area
    const Box box = box_of(open);
    const double volume_m3 = wound_columns(open, box, column_lattice(box, 0.02)).volume_m3();
    const double height_m = 0.1, cap_m3 = std::numbers::pi * height_m * height_m * (3.0 - height_m) / 3.0;
    CHECK(volume_m3 == Approx(divergence_volume(kSphere) - cap_m3).epsilon(0.01));
    const SurfaceScore s = score_by_choice(kSphere, open_truth(open));
    CHECK(s.truth_volume_m3 == Approx(divergence_volume(kSphere)).epsilon(0.02));
    CHECK(s.iou > 0.98);
    CHECK(s.recall > 0.999);
    CHECK(s.truth_open_fraction == 0.0);
  }
}

TEST_CASE("many small holes and triangles that look inward cost a body little", "[winding]") {
  SurfaceMesh holed = kSphere;  // one in 12: 8 %
  std::erase_if(holed.triangles, [n = 0](const glm::uvec3&) mutable { return n++ % 12 == 0; });
  CHECK(choice_of(open_truth(holed)).volume == TruthVolume::winding_number);
  CHECK(score_by_choice(kSphere, open_truth(holed)).iou > 0.97);
  const TruthSurface some_inward = open_truth(turned(kSphere, 20));
  ScoreOptions options = quick_score();
  options.truth_volume = TruthVolume::winding_number;
  CHECK(score(kSphere, some_inward, {}, options).iou > 0.95);
}

TEST_CASE("what is closed or encloses a volume is measured as ever", "[winding]") {
  const TruthSurface closed = solid_truth(kSphere);
  CHECK(choice_of(closed).volume == TruthVolume::closed_pieces);
  CHECK(choice_of(closed).reason.empty());
  // A winding number above 1/2 of a closed mesh is one above 0.
  const Box box = box_of(kSphere);
  const ColumnLattice lattice = column_lattice(box, 0.02);
  const Columns wound = wound_columns(kSphere, box, lattice), crossed = columns_of(kSphere, lattice);
  CHECK(wound.volume_m3() == crossed.volume_m3());
  CHECK(common_volume_m3(wound, crossed) == crossed.volume_m3());
  // A house without a floor, and a box of six sheets of any winding.
  SurfaceMesh house = box_mesh({-4, 0, -3}, {4, 4, 3});
  house.triangles.erase(house.triangles.begin() + 4, house.triangles.begin() + 6);
  CHECK(choice_of(open_truth(house)).volume == TruthVolume::enclosed);
  CHECK(choice_of(open_truth(turned(house, 3))).volume == TruthVolume::enclosed);
  // A closed wheel beside an open sphere is not the body.
  const SurfaceMesh wheel = sphere_mesh({2, 0, 0}, 0.2, 3);
  TruthSurface both{wheel, joined(wheel, cut(kSphere, {0, 1, 0.3}, 0.9)), wheel.triangles.size(), {}};
  CHECK(choice_of(both).volume == TruthVolume::winding_number);
}

TEST_CASE("what has no inside is compared by its surface alone", "[winding]") {
  const SurfaceMesh sheet{{{-1, 0.2, -1}, {1, 0.2, -1}, {1, 0.2, 1}, {-1, 0.2, 1}}, {{0, 2, 1}, {0, 3, 2}}};
  SurfaceMesh wall = sheet;
  for (glm::dvec3& v : wall.vertices_m) v = glm::dvec3(v.y, v.x, v.z);
  for (const SurfaceMesh& mesh : {sheet, wall, cut(kSphere, {0, 1, 0}, 0.0), cut(kSphere, {1, 0.2, 0}, 0.0)}) {
    const TruthVolumeChoice choice = choice_of(open_truth(mesh));
    CHECK(choice.volume == TruthVolume::none);
    CHECK(choice.reason.find("winding number") != std::string::npos);
    const SurfaceScore s = score_by_choice(kSphere, open_truth(mesh));
    for (const double value : {s.iou, s.precision, s.recall, s.truth_volume_m3, s.volume_error}) CHECK(std::isnan(value));
    CHECK(s.volume_m3 == Approx(divergence_volume(kSphere)).epsilon(1e-3));
    CHECK(s.whole.chamfer_m >= 0.0);
  }
  // A dome that stands on the ground holds what is under it.
  SurfaceMesh dome = kSphere;
  for (glm::dvec3& v : dome.vertices_m) v.y = std::max(v.y, 0.0);
  CHECK(choice_of(open_truth(cut(dome, {0, -1, 0}, -1e-9))).volume == TruthVolume::enclosed);
}

TEST_CASE("open pieces are turned outward, whichever way they were drawn", "[winding]") {
  Scene scene;
  const SurfaceMesh open = cut(kSphere, {0, 1, 0.3}, 0.9);
  const SurfaceMesh drawn = joined(open, moved(inverted(open), {3, 0, 0}));
  scene.mesh.vertices_m = drawn.vertices_m;
  scene.mesh.triangles = drawn.triangles;
  scene.mesh.piece.assign(drawn.triangles.size(), 0);
  for (std::size_t t = open.triangles.size(); t < drawn.triangles.size(); ++t) scene.mesh.piece[t] = 1;
  scene.pieces = {{false, 0}, {false, 0}};
  const TruthSurface truth = truth_of(scene);
  CHECK(truth.all.triangles == drawn.triangles);
  CHECK(truth.wound.triangles == joined(open, open).triangles);
  const SurfaceScore s = score_by_choice(joined(kSphere, moved(kSphere, {3, 0, 0})), truth);
  CHECK(s.iou > 0.97);
}

TEST_CASE("winding numbers do not depend on the number of threads, or on where the mesh is", "[winding]") {
  const SurfaceMesh open = cut(kSphere, {1, -2, 0.5}, 0.9);
  const auto score_with = [&](int n_threads, const glm::dvec3& by) {
    const ThreadLimit limit(n_threads);
    return score_by_choice(moved(kSphere, by), open_truth(moved(open, by)));
  };
  const SurfaceScore one = score_with(1, {}), three = score_with(3, {}), far = score_with(2, {5e5, 120.0, -4.2e6});
  CHECK(one.iou == three.iou);
  CHECK(one.truth_volume_m3 == three.truth_volume_m3);
  CHECK(far.iou == Approx(one.iou).epsilon(1e-4));
}
