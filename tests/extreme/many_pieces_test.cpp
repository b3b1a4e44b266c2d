// SPDX-License-Identifier: Apache-2.0
// Meshes of very many pieces, and of vertices that their file has rounded.
#include <bit>
#include <cstdlib>
#include <cstring>

#include "catch.h"
#include "extreme_meshes.h"
#include "matrix.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Binary PLY, vertices in float32 or double.
template <class Real>
class PlyBuilder {
 public:
  std::uint32_t vertex(const glm::dvec3& p) {
    for (int axis = 0; axis < 3; ++axis) append(vertices_, static_cast<Real>(p[axis]));
    return n_vertices_++;
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    append(faces_, std::uint8_t{3});
    for (const std::uint32_t v : {a, b, c}) append(faces_, v);
    ++n_faces_;
  }
  std::string bytes() const {
    const std::string real = sizeof(Real) == 4 ? "float" : "double";
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(n_vertices_) + "\nproperty " + real +
           " x\nproperty " + real + " y\nproperty " + real + " z\nelement face " + std::to_string(n_faces_) +
           "\nproperty list uchar uint vertex_indices\nend_header\n" + vertices_ + faces_;
  }

 private:
  static_assert(std::endian::native == std::endian::little);
  template <class Value>
  static void append(std::string& to, Value value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    to.append(bytes, sizeof value);
  }
  std::string vertices_, faces_;
  std::uint32_t n_vertices_ = 0, n_faces_ = 0;
};

/// Σ β⁰ Δa Δr.
double energy(const Image<float>& image, const Acquisition& a) {
  return sum(image) * a.azimuth_spacing_m * a.range_spacing_m;
}

/// Whole numbers from 0 that tile a square: the n-th place on a lattice of so many columns.
glm::dvec3 place_of(int n, int n_columns, double pitch_m) {
  return pitch_m * glm::dvec3(n % n_columns - n_columns / 2, 0.0, n / n_columns - n_columns / 2);
}

/// A tetrahedron standing on y = 0, of some side.
template <class Builder>
void add_tetrahedron(Builder& mesh, const glm::dvec3& at, double side_m, bool inverted) {
  const auto a = mesh.vertex(at), b = mesh.vertex(at + side_m * glm::dvec3(1.0, 0.0, 0.0)),
             c = mesh.vertex(at + side_m * glm::dvec3(0.0, 0.0, 1.0)), d = mesh.vertex(at + side_m * glm::dvec3(0.2, 1.0, 0.2));
  const auto add = [&](auto p, auto q, auto r) { inverted ? mesh.triangle(p, r, q) : mesh.triangle(p, q, r); };
  add(a, b, c);
  add(a, d, b);
  add(b, d, c);
  add(c, d, a);
}

}  // namespace

TEST_CASE("a million pieces", "[meshes]") {
  constexpr int kColumns = 1000;
  constexpr double kPitch_m = 1.0, kArea_m2 = 0.5 * 0.8 * 0.8;
  PlyBuilder<float> ply;
  for (int n = 0; n < kColumns * kColumns; ++n) {
    const glm::dvec3 at = place_of(n, kColumns, kPitch_m);
    const auto first = ply.vertex(at);
    ply.vertex(at + glm::dvec3(0.0, 0.0, 0.8));
    ply.vertex(at + glm::dvec3(0.8, 0.0, 0.0));
    ply.triangle(first, first + 1, first + 2);
  }
  Scene scene = load_text("mesh.ply", ply.bytes());
  CHECK(scene.pieces.size() == kColumns * kColumns);
  scene.materials.front() = matte();
  const auto view = [](double spacing_m) {
    Acquisition a = view_of(40.0, 7e5, static_cast<int>(1080.0 / spacing_m), static_cast<int>(800.0 / spacing_m), spacing_m);
    a.azimuth_rad = 0.02;
    return a;
  };
  const Acquisition a = view(8.0), finer = view(2.0);
  const double expected = kArea_m2 * kColumns * kColumns * std::cos(a.incidence_rad);
  const SurfaceEngine engine(scene);
  const ViewPlan automatic = engine.plan(a, {});
  // Pixels of 8 m and rays 2 m apart: most triangles are met by none. Rays that resolve them give their areas.
  const double coarse = energy(engine.render(automatic).beta0, a) / expected - 1.0;
  const double fine = energy(engine.render(engine.plan(a, {16 * automatic.fan.n_elevation, 8, Integrator::exact})).beta0, a) / expected - 1.0;
  // Rays half a metre apart: as far as triangles are long, of which some are then measured and others guessed.
  const double between = energy(engine.render(engine.plan(finer, {0, 2, Integrator::exact})).beta0, finer) / expected - 1.0;
  INFO("automatic " << coarse << ", 16 times the rays " << fine << ", rays as far apart as triangles are long " << between);
  for (const double error : {coarse, fine}) record(Case::many_pieces, error);
  record(Case::small_pieces, between);
  CHECK(std::abs(coarse) < 0.01);
  CHECK(std::abs(fine) < 0.001);
  CHECK(std::abs(between) < 0.1);
}

TEST_CASE("very many solids, every other one inside out", "[meshes]") {
  const char* wanted = std::getenv("SARNERF_EXTREME_PIECES");
  const int n_pieces = wanted != nullptr ? std::atoi(wanted) : 100'000;
  const int n_columns = static_cast<int>(std::ceil(std::sqrt(double(n_pieces))));
  const auto render = [](const std::string& ply, std::size_t n, Acquisition a) {
    Scene scene = load_text("mesh.ply", ply);
    CHECK(scene.pieces.size() == n);
    CHECK(scene.pieces.back().closed);
    scene.materials.front() = matte(1.0);
    return energy(render_surface(scene, a), a);
  };
  PlyBuilder<float> one, many;
  add_tetrahedron(one, glm::dvec3(-0.5, 0.0, -0.5), 1.0, false);
  for (int n = 0; n < n_pieces; ++n) {
    // Far enough apart that none is in the shadow of another.
    add_tetrahedron(many, place_of(n, n_columns, 3.0), 1.0, n % 2 == 1);
  }
  Acquisition near = view_of(40.0, 7e5, 64, 64, 0.1);
  const int n_rows = static_cast<int>(1.6 * n_columns), n_bins = static_cast<int>(1.1 * n_columns);
  const Acquisition far = view_of(40.0, 7e5, n_rows, n_bins, 2.0);
  const double expected = render(one.bytes(), 1, near) * n_pieces;
  const double error = render(many.bytes(), static_cast<std::size_t>(n_pieces), far) / expected - 1.0;
  record(Case::many_solids, error);
  CHECK(std::abs(error) < 0.02);
}

TEST_CASE("very many solids of some voxels, every other one inside out", "[meshes]") {
  constexpr int kColumns = 30;
  ObjBuilder well, badly;
  for (int n = 0; n < kColumns * kColumns; ++n) {
    add_tetrahedron(well, place_of(n, kColumns, 3.0), 1.2, false);
    add_tetrahedron(badly, place_of(n, kColumns, 3.0), 1.2, n % 2 == 1);
  }
  const Acquisition a = view_of(40.0, 1e4, 110, 80, 1.0);
  const Image<float> expected = render_voxels(load_text("mesh.obj", well.text()), a, 0.3);
  CHECK(sum(expected) > 0.0);
  const double error = relative_l2(render_voxels(load_text("mesh.obj", badly.text()), a, 0.3), expected);
  record(Case::many_voxel_pieces, error);
  CHECK(error < 1e-6);
}

TEST_CASE("files that round map coordinates are told of", "[meshes]") {
  const glm::dvec3 where(512345.3, 120.1, -4123456.7);
  const auto bytes = [&](auto real, const glm::dvec3& at) {
    PlyBuilder<decltype(real)> ply;
    add_tetrahedron(ply, at, 10.0, false);
    return ply.bytes();
  };
  const auto warns = [](const Scene& scene) { return has_line(scene.report.warnings, "stored in single precision"); };
  const Scene rounded = load_text("mesh.ply", bytes(0.0f, where)), exact = load_text("mesh.ply", bytes(0.0, where));
  CHECK(warns(rounded));
  CHECK(has_line(rounded.report.warnings, "rounded by up to 0.246 m"));
  CHECK_FALSE(warns(exact));
  CHECK_FALSE(warns(load_text("mesh.ply", bytes(0.0f, glm::dvec3(20.0, 0.0, -300.0)))));
  record(Case::rounded_files, glm::length(rounded.mesh.vertices_m[0] - exact.mesh.vertices_m[0]));
  // A binary STL of one facet.
  std::string stl(80, ' ');
  const auto append = [&](auto value) {
    char text[sizeof value];
    std::memcpy(text, &value, sizeof value);
    stl.append(text, sizeof value);
  };
  append(std::uint32_t{1});
  for (const float v : {0.f, 0.f, 1.f, 5e5f, 4e6f, 1.f, 500020.f, 4e6f, 1.f, 5e5f, 4000020.f, 1.f}) append(v);
  append(std::uint16_t{0});
  CHECK(warns(load_text("mesh.stl", stl)));
}

TEST_CASE("materials beyond single precision are refused", "[meshes]") {
  const ScratchFolder folder;
  const auto refusal = [&](const std::string& material) {
    const auto file = folder.write("materials.json", R"({"format":"sarnerf-materials","version":1,"materials":{"default":)" +
                                                         material + "}}");
    return message_of<InputError>([&] { (void)MaterialLibrary().add_file(file); });
  };
  CHECK(refusal(R"({"extinction_per_m":1e30,"scattering_per_m":1e30})").empty());
  for (const char* material : {R"({"extinction_per_m":1e39,"scattering_per_m":1})",
                               R"({"extinction_per_m":1,"scattering_per_m":1e300})",
                               R"({"extinction_per_m":1,"extinction_back_per_m":1e40,"scattering_per_m":1})"}) {
    CHECK(contains(refusal(material), "expected a number between 0 and 1e+30"));
  }
}
