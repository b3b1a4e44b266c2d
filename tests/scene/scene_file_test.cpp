// SPDX-License-Identifier: Apache-2.0
#include <glm/gtc/matrix_transform.hpp>

#include "catch.h"
#include "files.h"
#include "solids.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A folder with a unit cube "cube.obj" whose corner lies at the origin, and scenes beside it.
class Fixture {
 public:
  Fixture() {
    ObjBuilder obj;
    obj.line("g body");
    obj.cube({0, 0, 0}, 1.0);
    folder_.write("cube.obj", obj.text());
  }
  Scene scene(const std::string& rest, const LoadOptions& options = {}) const {
    return load_scene(
        folder_.write("s.json", R"({"format": "sarnerf-scene", "version": 1, )" + rest + "}"),
        options);
  }
  Scene mesh(const std::string& keys) const {
    return scene(R"("meshes": [{"file": "cube.obj")" + keys + "}]");
  }
  std::string refusal(const std::string& rest) const {
    return message_of<InputError>([&] { scene(rest); });
  }

 private:
  ScratchFolder folder_;
};

bool near(const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 1e-12; }

}  // namespace

TEST_CASE("Placement: units, scale, rotation, translation") {
  const Fixture f;
  const Scene scaled = f.mesh(R"(, "units": "cm", "scale": 250, "translate_m": [10, 0, -3])");
  CHECK(near(scaled.box.min, {10, 0, -3}));
  CHECK(near(scaled.box.max, {12.5, 2.5, -0.5}));

  // A quarter turn about Y takes +X to −Z, as azimuth turns +Z to +X.
  const Scene turned = f.mesh(R"(, "rotate_deg": [0, 90, 0])");
  CHECK(near(turned.box.min, {0, 0, -1}));
  CHECK(near(turned.box.max, {1, 1, 0}));
  CHECK(turned.box.min == glm::dvec3(0, 0, -1));  // right angles are exact

  const Scene about_axis = f.mesh(R"(, "rotate_deg": {"axis": [0, 2, 0], "angle": 90})");
  CHECK(near(about_axis.box.min, turned.box.min));

  // x first, then y, then z: (0,1,0) → (0,0,1) → (1,0,0) → (0,1,0).
  const Scene all = f.mesh(R"(, "rotate_deg": [90, 90, 90])");
  const glm::dmat4 world_from_object = glm::inverse(all.objects[0].object_from_world);
  CHECK(near(glm::dvec3(world_from_object * glm::dvec4(0, 1, 0, 1)), {0, 1, 0}));
  CHECK(near(glm::dvec3(world_from_object * glm::dvec4(1, 0, 0, 1)), {0, 0, -1}));
}

TEST_CASE("object_from_world takes triangles back to metres before placement") {
  const Fixture f;
  for (const char* keys : {"", R"(, "translate_m": [500000.5, 12, -4800000.25])",
                           R"(, "rotate_deg": [10, 20, 30], "translate_m": [1, 2, 3])",
                           R"(, "rotate_deg": {"axis": [1, 1, 0], "angle": -77})"}) {
    const Scene scene = f.mesh(std::string(R"(, "units": 2)") + keys);
    REQUIRE(scene.objects.size() == 1);
    Box box;
    for (const glm::dvec3& v : scene.mesh.vertices_m) {
      box.include(glm::dvec3(scene.objects[0].object_from_world * glm::dvec4(v, 1.0)));
    }
    CHECK(glm::length(box.min - glm::dvec3(0.0)) < 2e-9);
    CHECK(glm::length(box.max - glm::dvec3(2.0)) < 2e-9);
    CHECK(signed_volume(scene, 0) == Approx(8.0));
  }
}

TEST_CASE("Z up: of a mesh, of a scene, from the command line") {
  const ScratchFolder folder;
  const auto mesh = folder.write("t.obj", "v 1 2 3\nv 4 2 3\nv 1 2 8\nf 1 2 3\n");
  LoadOptions z_up;
  z_up.up = UpAxis::z;
  const Scene alone = load_scene(mesh, z_up);
  CHECK(alone.mesh.vertices_m[0] == glm::dvec3(1, 3, -2));
  CHECK(alone.box.max.y == 8.0);
  CHECK(alone.objects[0].object_from_world == glm::dmat4(1.0));

  const auto scene = [&](const std::string& text) {
    return load_scene(
        folder.write("s.json", R"({"format": "sarnerf-scene", "version": 1, )" + text + "}"), {});
  };
  CHECK(scene(R"("meshes": [{"file": "t.obj", "up": "z"}])").mesh.vertices_m[0] ==
        glm::dvec3(1, 3, -2));
  // In a Z-up scene, translations have Z up as well, and meshes unless they say otherwise.
  CHECK(scene(R"("up": "z", "meshes": [{"file": "t.obj", "translate_m": [0, 0, 10]}])")
            .mesh.vertices_m[0] == glm::dvec3(1, 13, -2));
  CHECK(scene(R"("up": "z", "meshes": [{"file": "t.obj", "up": "y", "translate_m": [0, 0, 10]}])")
            .mesh.vertices_m[0] == glm::dvec3(1, 12, 3));
}

TEST_CASE("Several meshes, materials and a ground") {
  const Fixture f;
  const Scene scene = f.scene(R"(
      "meshes": [{"file": "cube.obj", "material": "metal"},
                 {"file": "cube.obj", "translate_m": [3, 0, 0], "materials": {"body": "mine"}},
                 {"file": "cube.obj", "translate_m": [6, -2, 0]}],
      "materials": {"mine": {"gamma0": 0.4}},
      "ground": {"material": "grass"})");
  CHECK(scene.objects.size() == 3);
  CHECK(scene.pieces.size() == 3);
  CHECK(scene.pieces[2].object == 2);
  CHECK(scene.groups == std::vector<std::string>{"body"});
  std::vector<std::string> names;
  for (const Material& m : scene.materials) names.push_back(m.name);
  CHECK(names == std::vector<std::string>{"metal", "mine", "default", "grass"});
  REQUIRE(scene.ground);
  CHECK(scene.ground->material == 3);
  CHECK(scene.ground->height_m == -2.0);  // the lowest height of all meshes
  CHECK(scene.box.min == glm::dvec3(0, -2, 0));
  CHECK(scene.box.max == glm::dvec3(7, 1, 1));
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const glm::dvec3 v = scene.mesh.vertices_m[scene.mesh.triangles[t].x];
    CHECK(scene.pieces[scene.mesh.piece[t]].object == static_cast<std::uint32_t>(v.x / 3.0));
  }
}

TEST_CASE("The command line overrules a scene's ground") {
  const Fixture f;
  const std::string text =
      R"("meshes": [{"file": "cube.obj"}], "ground": {"material": "grass", "height_m": -1})";
  CHECK(f.scene(text).ground->height_m == -1.0);
  LoadOptions options;
  options.ground_height_m = -0.5;
  CHECK(f.scene(text, options).ground->height_m == -0.5);
  options.ground_material = "asphalt";
  const Scene paved = f.scene(text, options);
  CHECK(paved.materials[paved.ground->material].name == "asphalt");
  options.ground_material = "none";
  CHECK_FALSE(f.scene(text, options).ground);
  options.ground_material = "asfalt";
  CHECK(contains(message_of<UsageError>([&] { f.scene(text, options); }),
                 "--ground: unknown material 'asfalt' (asphalt?)"));
  options.ground_material = "canopy";
  CHECK(contains(message_of<UsageError>([&] { f.scene(text, options); }), "translucent"));
}

TEST_CASE("A ground alone is a scene") {
  const Fixture f;
  const Scene scene = f.scene(R"("meshes": [], "ground": {"material": "soil", "height_m": 3})");
  CHECK(scene.box.empty());
  CHECK(scene.ground->height_m == 3.0);
  CHECK(contains(f.refusal(R"("meshes": [])"), "a mesh or a ground"));
}

TEST_CASE("Scene files that cannot be used") {
  const Fixture f;
  CHECK(contains(f.refusal(R"("mesh": [])"), "unknown key 'mesh' (meshes?)"));
  CHECK(contains(f.refusal(R"("up": "x", "meshes": [])"), "s.json: up: expected \"y\" or \"z\""));
  CHECK(contains(f.refusal(R"("materials": {})"), "'meshes' is missing"));
  const auto mesh = [&](const std::string& keys) {
    return f.refusal(R"("meshes": [{"file": "cube.obj"}, {)" + keys + "}]");
  };
  CHECK(contains(mesh(""), "meshes[1]: the key 'file' is missing"));
  CHECK(contains(mesh(R"("file": "none.obj")"), "no such file"));
  CHECK(contains(mesh(R"("file": "s.json")"), ".obj, .ply, .stl or .off"));
  CHECK(contains(mesh(R"("file": "cube.obj", "scale": 0)"),
                 "meshes[1].scale: expected a number above 0"));
  CHECK(contains(mesh(R"("file": "cube.obj", "units": "yd")"), "found \"yd\""));
  CHECK(contains(mesh(R"("file": "cube.obj", "translate_m": [1, 2])"), "three numbers"));
  for (const char* far : {"1.1e12", "-1e300"}) {
    CHECK(contains(mesh(R"("file": "cube.obj", "translate_m": [0, )" + std::string(far) + ", 0]"),
                   "meshes[1].translate_m: expected three numbers between -1e+12 and 1e+12"));
    CHECK(contains(f.refusal(R"("meshes": [], "ground": {"material": "grass", "height_m": )" + std::string(far) + "}"),
                   "ground.height_m: expected a height within 1e+12 m"));
  }
  CHECK(contains(mesh(R"("file": "cube.obj", "rotate_deg": {"axis": [0, 0, 0], "angle": 1})"),
                 "direction"));
  CHECK(contains(mesh(R"("file": "cube.obj", "translate": [1, 2, 3])"), "(translate_m?)"));
  CHECK(contains(mesh(R"("file": "cube.obj", "material": "steel")"),
                 "meshes[1].material: unknown material 'steel'"));
  CHECK(contains(mesh(R"("file": "cube.obj", "materials": {"body": "gras"})"), "(grass?)"));
  CHECK(contains(f.refusal(R"("meshes": [], "ground": {"material": "lava", "height_m": 0})"),
                 "'lava'"));
  CHECK(contains(f.refusal(R"("meshes": [], "materials_file": "none.json")"), "none.json"));
}

TEST_CASE("A name that the mesh does not have is pointed out") {
  const Fixture f;
  const Scene scene = f.mesh(R"(, "materials": {"boddy": "metal"})");
  CHECK(has_line(scene.report.warnings, "'boddy'; it has: body"));
}

TEST_CASE("Options of a mesh do not fit a scene file; options without meaning fit nothing") {
  const Fixture f;
  LoadOptions options;
  options.scale = 2.0;
  CHECK_THROWS_AS(f.scene(R"("meshes": [{"file": "cube.obj"}])", options), UsageError);
  options.scale = -1.0;
  CHECK_THROWS_AS(load_text("a.obj", "v 0 0 0\n", options), UsageError);
}

TEST_CASE("Suspicious sizes are pointed out") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 1.0);
  LoadOptions options;
  options.units_m = 0.001;
  CHECK(has_line(load_text("a.obj", obj.text(), options).report.warnings, "suspiciously small"));
  options.units_m = 1e6;
  CHECK(has_line(load_text("a.obj", obj.text(), options).report.warnings, "--units and --scale"));
  options.units_m = 1.0;
  options.ground_material = "grass";
  options.ground_height_m = 2.0;
  CHECK(has_line(load_text("a.obj", obj.text(), options).report.warnings, "above the whole scene"));
}
