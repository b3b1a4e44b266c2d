// SPDX-License-Identifier: Apache-2.0
#include "catch.h"
#include "files.h"
#include "solids.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Material parse(const std::string& json) {
  MaterialLibrary library;
  library.add_json("{\"m\": " + json + "}", "test");
  return library.require("m", "test");
}

std::string refusal(const std::string& json) {
  return message_of<InputError>([&] { parse(json); });
}

}  // namespace

TEST_CASE("Materials: keys, defaults, kinds") {
  const Material plain = parse("{}");
  CHECK(plain.opaque);
  CHECK(plain.gamma0 == 1.0);
  CHECK(plain.exponent == 1.0);
  CHECK(plain.texture.kind == Texture::Kind::none);

  const Material checker = parse(
      R"({"opaque": true, "gamma0": 0.3, "exponent": 2,
          "texture": {"kind": "checker", "period_m": 2, "contrast": 0.25}})");
  CHECK(checker.gamma0 == 0.3);
  CHECK(checker.texture.kind == Texture::Kind::checker);
  CHECK(checker.texture.effective_origin_m() == glm::dvec3(0.5));
  CHECK(
      parse(
          R"({"texture": {"kind": "checker", "period_m": 2, "contrast": 1, "origin_m": [1, 2, 3]}})")
          .texture.effective_origin_m() == glm::dvec3(1, 2, 3));

  const Material leaves = parse(R"({"extinction_per_m": 0.2, "scattering_per_m": 0.05})");
  CHECK_FALSE(leaves.opaque);
  CHECK(leaves.extinction_back_per_m == 0.2);
  CHECK(parse(R"({"opaque": false, "extinction_per_m": 0.2, "extinction_back_per_m": 0.1})")
            .extinction_back_per_m == 0.1);
}

TEST_CASE("Materials without meaning are refused, by key") {
  CHECK(contains(refusal(R"({"gama0": 1})"),
                 "test: m: unknown key 'gama0' (gamma0?); known are: opaque"));
  CHECK(contains(refusal(R"({"gamma0": -1})"),
                 "test: m.gamma0: expected a number of at least 0, found -1"));
  CHECK(contains(refusal(R"({"gamma0": "bright"})"), "expected a number, found \"bright\""));
  CHECK(contains(refusal(R"({"gamma0": 1e999})"), "JSON"));
  CHECK(contains(refusal(R"({"exponent": -0.5})"), "test: m.exponent"));
  CHECK(contains(refusal(R"({"opaque": 1})"), "true or false"));
  CHECK(contains(refusal(R"({"opaque": true, "extinction_per_m": 1})"),
                 "opaque material takes gamma0"));
  CHECK(contains(refusal(R"({"opaque": false})"), "'extinction_per_m' is missing"));
  CHECK(
      contains(refusal(R"({"opaque": false, "extinction_per_m": 1, "gamma0": 1})"), "not gamma0"));
  CHECK(contains(refusal(R"({"gamma0": 1, "extinction_per_m": 1})"), "not gamma0"));
  CHECK(contains(refusal(R"({"extinction_per_m": -1})"), "extinction_per_m"));
  CHECK(contains(refusal(R"({"texture": {"kind": "stripes"}})"), "\"checker\", found \"stripes\""));
  CHECK(contains(refusal(R"({"texture": {"kind": "checker", "contrast": 0.1}})"),
                 "'period_m' is missing"));
  CHECK(contains(refusal(R"({"texture": {"kind": "checker", "period_m": 0, "contrast": 0.1}})"),
                 "at least 1e-09"));
  CHECK(contains(refusal(R"({"texture": {"kind": "checker", "period_m": 1, "contrast": 0.1,
                             "origin_m": [0, 1e13, 0]}})"),
                 "1e+12"));
  CHECK(contains(refusal(R"({"texture": {"kind": "checker", "period_m": 1, "contrast": 2}})"),
                 "between 0 and 1"));
  CHECK(contains(refusal(R"([1])"), "object in braces"));
}

TEST_CASE("Materials files: format, version, syntax, keys that stand twice") {
  const ScratchFolder folder;
  const auto load = [&](std::string_view text) {
    const auto file = folder.write("m.json", text);
    return message_of<InputError>([&] { MaterialLibrary().add_file(file); });
  };
  CHECK(load(R"({"format": "sarnerf-materials", "version": 1, "materials": {"x": {}}})").empty());
  CHECK(contains(load(R"({"format": "sarnerf-scene", "version": 1, "materials": {}})"),
                 "sarnerf-materials"));
  CHECK(contains(load(R"({"format": "sarnerf-materials", "version": 2, "materials": {}})"),
                 "version: expected 1"));
  CHECK(contains(load(R"({"version": 1, "materials": {}})"), "'format' is missing"));
  CHECK(contains(load(R"({"format": "sarnerf-materials", "version": 1, "extra": 0})"), "'extra'"));
  CHECK(contains(load("{\"format\":\n oops}"), "line 2"));
  CHECK(contains(load(R"({"materials": {"a": {}, "a": {}}})"), "'a' is given twice"));
  CHECK(contains(load(""), "empty"));
}

TEST_CASE("Later materials win; unknown ones are named with the closest") {
  MaterialLibrary library;
  const std::size_t n_builtin = library.names().size();
  CHECK(n_builtin >= 12);
  Material grey;
  grey.name = "concrete";
  grey.gamma0 = 0.01;
  library.add(grey);
  CHECK(library.names().size() == n_builtin);
  CHECK(library.find("concrete")->gamma0 == 0.01);
  CHECK(library.find("Concrete") == nullptr);
  const std::string message =
      message_of<InputError>([&] { library.require("conrete", "--ground"); });
  CHECK(contains(message,
                 "--ground: unknown material 'conrete' (concrete?); known are: asphalt, brick"));
}

TEST_CASE("The built-in table is physical") {
  for (const Material& m : builtin_materials()) {
    INFO(m.name);
    if (m.opaque) {
      CHECK(m.gamma0 > 0.0);
      CHECK(m.exponent >= 0.0);
    } else {
      CHECK(m.extinction_per_m > 0.0);
      // A thick layer scatters back P / (κ⁺ + κ⁻) of what comes in; isotropic scatterers without loss ½.
      CHECK(m.scattering_per_m / (m.extinction_per_m + m.extinction_back_per_m) < 0.5);
    }
  }
  CHECK(MaterialLibrary().find("default")->gamma0 == 1.0);
}

TEST_CASE("Names from a mesh: found, or default with a note, or with a warning") {
  const ScratchFolder folder;
  ObjBuilder obj;
  obj.line("mtllib missing.mtl\nusemtl asphalt");
  obj.cube({0, 0, 0}, 1.0);
  obj.line("usemtl Body_Paint.001");
  obj.cube({5, 0, 0}, 1.0);
  const auto mesh = folder.write("m.obj", obj.text());

  const Scene scene = load_scene(mesh, {});
  REQUIRE(scene.materials.size() == 2);
  CHECK(scene.materials[0].name == "asphalt");
  CHECK(scene.materials[1].name == "default");
  CHECK(has_line(scene.report.notes, "rendered with the material 'default': Body_Paint.001"));
  CHECK(scene.report.warnings.empty());

  LoadOptions options;
  options.materials_file =
      folder.write("mine.json", R"({"format": "sarnerf-materials", "version": 1,
                       "materials": {"asphalt": {"gamma0": 0.5}, "default": {"gamma0": 0.7}}})");
  const Scene mine = load_scene(mesh, options);
  CHECK(mine.materials[0].gamma0 == 0.5);
  CHECK(mine.materials[1].gamma0 == 0.7);
  CHECK(has_line(mine.report.warnings, "Body_Paint.001"));
}
