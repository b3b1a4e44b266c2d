// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/surface_mesh.h"

#include <algorithm>

#include "catch.h"
#include "file_size_limit.h"
#include "level_surface.h"
#include "sarnerf/core/error.h"
#include "sarnerf/scene/scene.h"
#include "scratch_folder.h"
#include "surface_checks.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Two blobs in map coordinates, with coordinates of many digits.
SurfaceMesh blobs(const glm::dvec3& origin_m = {500123.456, 31.7, -4212345.678}) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const auto transform = openvdb::math::Transform::createLinearTransform(0.078125 / 3.0);
  transform->postTranslate({origin_m.x, origin_m.y, origin_m.z});
  grid->setTransform(transform);
  auto accessor = grid->getAccessor();
  for (int x = -9; x <= 9; ++x)
    for (int y = -9; y <= 9; ++y)
      for (int z = -9; z <= 9; ++z) {
        const double occupancy = std::clamp(0.5 * (8.0 - glm::length(glm::dvec3(x, 1.3 * y, z))), 0.0, 1.0);
        for (const int apart : {0, 40}) accessor.setValue({x + apart, y, z}, static_cast<float>(occupancy));
      }
  return level_surface(*grid);
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Of the refusal, or empty.
template <class Exception>
std::string message_of(const SurfaceMesh& mesh, const std::filesystem::path& path) {
  try {
    write_mesh(mesh, path);
  } catch (const Exception& error) {
    return error.what();
  }
  return {};
}

std::size_t n_files(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

TEST_CASE("load_scene reads back the very triangles that were written") {
  const ScratchFolder folder;
  const SurfaceMesh mesh = blobs();
  for (const char* name : {"a.ply", "a.obj", "B.PLY", "B.Obj"}) {
    INFO(name);
    write_mesh(mesh, folder / name, "sar_extract model.pt out.vdb");
    const Scene scene = load_scene(folder / name, {});
    CHECK((scene.mesh.vertices_m == mesh.vertices_m));
    CHECK((scene.mesh.triangles == mesh.triangles));
    CHECK(scene.report.warnings.empty());
    REQUIRE(scene.pieces.size() == 2);
    CHECK(scene.pieces[0].closed);
    CHECK(scene.pieces[1].closed);
  }
}

TEST_CASE("mesh files say units and axis and where they come from") {
  const ScratchFolder folder;
  const std::string provenance = "first line\r\nend_header\nC:\\folder\\";
  for (const char* name : {"a.ply", "a.obj"}) {
    INFO(name);
    write_mesh(blobs(), folder / name, provenance);
    const std::string mark = std::string(name) == "a.ply" ? "\ncomment " : "\n# ";
    const std::string text = read_text(folder / name);
    CHECK(contains(text, mark + "units: m\n"));
    CHECK(contains(text, mark + "up axis: Y\n"));
    CHECK(contains(text, mark + "first line \n"));
    CHECK(contains(text, mark + "C:\\folder\\\n"));
    CHECK((load_scene(folder / name, {}).mesh.vertices_m == blobs().vertices_m));
  }
}

TEST_CASE("the same mesh gives the same bytes") {
  const ScratchFolder folder;
  for (const std::string ending : {".ply", ".obj"}) {
    write_mesh(blobs(), folder / ("a" + ending), "x");
    write_mesh(blobs(), folder / ("b" + ending), "x");
    CHECK(read_text(folder / ("a" + ending)) == read_text(folder / ("b" + ending)));
  }
}

TEST_CASE("a mesh file of another ending is refused with what there is") {
  const ScratchFolder folder;
  for (const char* name : {"a.stl", "a", "a.ply.gz", ".ply"}) {
    INFO(name);
    CHECK_THROWS_AS(require_mesh_ending(folder / name), UsageError);
    CHECK(contains(message_of<UsageError>(blobs(), folder / name), "ends in .ply or .obj"));
  }
  CHECK(n_files(folder.path()) == 0);
}

TEST_CASE("a full disk leaves the mesh that was there") {
  const ScratchFolder folder;
  for (const std::string name : {"a.ply", "a.obj"}) {
    write_text(folder / name, "old");
    {
      const FileSizeLimit limit(1000);
      CHECK(contains(message_of<Error>(blobs(), folder / name), name));
    }
    CHECK(read_text(folder / name) == "old");
  }
  CHECK(n_files(folder.path()) == 2);
  CHECK_THROWS_AS(write_mesh(blobs(), folder / "missing" / "a.ply"), Error);
}

TEST_CASE("an empty surface is a file without faces") {
  const ScratchFolder folder;
  write_mesh({}, folder / "a.ply");
  CHECK(contains(read_text(folder / "a.ply"), "element face 0\n"));
  write_mesh({}, folder / "a.obj");
  CHECK_FALSE(contains(read_text(folder / "a.obj"), "\nf "));
}
