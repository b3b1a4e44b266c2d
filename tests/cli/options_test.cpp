// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "catch.h"
#include "program.h"
#include "sarnerf/dataset/image_file.h"

using namespace sarnerf;

TEST_CASE("help and version go to stdout") {
  const SceneFolder folder;
  const Outcome help = folder.run({"--help"});
  CHECK(help.code == 0);
  CHECK(help.err.empty());
  for (const char* piece : {"--pitch", "--depression", "--slant-range", "[10000]", "[0.3]", "(m)",
                            "--max-memory", "--config", "-q", "-v", "Exit codes"}) {
    INFO(piece);
    CHECK(has(help.out, piece));
  }
  const Outcome version = folder.run({"--version"});
  CHECK(version.code == 0);
  CHECK(version.out.starts_with("sar_render "));
}

TEST_CASE("options that mean the same make the same image") {
  const SceneFolder folder;
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"a", {"--pitch", "30", "--altitude", "1000"}},
      {"b", {"--depression", "60", "--altitude", "1000"}},
      {"c", {"--pitch", "30", "--depression", "60", "--altitude", "1000"}},
      {"d", {"--pitch", "30", "--slant-range", std::to_string(1000 / std::cos(std::acos(-1.0) / 6))}},
      {"e", {"--pitch", "30", "--altitude", "1000", "--azimuth", "360"}},
      {"f", {"--pitch", "30", "--altitude", "1000", "--aim", "0,0,0", "--threads", "1"}}};
  for (const auto& [name, arguments] : commands) {
    INFO(name);
    std::vector<std::string> all = {"box.obj", "-o", name, "--size", "40x50", "-q"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Outcome outcome = folder.run(all);
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(outcome.err.empty());
  }
  const Image<float> a = read_image(folder / "a.tif");
  for (const char* name : {"b.tif", "c.tif", "f.tif"}) {
    CHECK(read_text(folder / name) == read_text(folder / "a.tif"));
  }
  for (const char* name : {"d.tif", "e.tif"}) {
    const Image<float> other = read_image(folder / name);
    double largest = 0.0, difference = 0.0;
    for (std::size_t n = 0; n < a.pixels().size(); ++n) {
      largest = std::max(largest, double(a.pixels()[n]));
      difference = std::max(difference, std::abs(double(a.pixels()[n]) - other.pixels()[n]));
    }
    CHECK(difference < 1e-3 * largest);
  }
}

TEST_CASE("units, scale and up axis place the mesh") {
  const SceneFolder folder;
  const std::vector<std::string> common = {"--pitch", "40", "--size", "32x48", "-q", "-o"};
  const auto render = [&](const std::string& mesh, const std::string& name,
                          const std::vector<std::string>& more) {
    const Outcome outcome = folder.run(with(with(with({mesh}, common), {name}), more));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    return read_text(folder / (name + ".tif"));
  };
  // The box of box.obj in half metres, Z up.
  write_text(folder / "z.obj",
             "v -4 2 0\nv 4 2 0\nv 4 -2 0\nv -4 -2 0\nv -4 2 6\nv 4 2 6\nv 4 -2 6\nv -4 -2 6\n"
             "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n");
  const std::string expected = render("box.obj", "a", {});
  CHECK(render("z.obj", "b", {"--up", "z", "--units", "0.5"}) == expected);
  CHECK(render("z.obj", "c", {"--up", "z", "--scale", "0.5"}) == expected);
  CHECK(render("box.obj", "d", {"--scale", "2"}) != expected);
}

TEST_CASE("calibration and quantity follow from power in beta0") {
  const SceneFolder folder;
  const auto render = [&](const char* name, const std::vector<std::string>& more) {
    CHECK(folder.run(with({"box.obj", "--pitch", "35", "--size", "32x48", "-q", "-o", name}, more)).code == 0);
    return read_image(folder / (std::string(name) + ".tif"));
  };
  const auto beta0 = render("a", {}), sigma0 = render("b", {"--calibration", "sigma0"}),
             gamma0 = render("c", {"--calibration", "gamma0"}),
             amplitude = render("d", {"--quantity", "amplitude"});
  const double incidence = 35.0 / 180.0 * std::acos(-1.0);
  bool any = false;
  for (std::size_t n = 0; n < beta0.pixels().size(); ++n) {
    const double b = beta0.pixels()[n];
    any = any || b > 0.0;
    // The swath of 14 m at 12 km covers 0.1 degrees.
    CHECK(sigma0.pixels()[n] == Approx(b * std::sin(incidence)).epsilon(2e-3));
    CHECK(gamma0.pixels()[n] == Approx(b * std::tan(incidence)).epsilon(2e-3));
    CHECK(amplitude.pixels()[n] == Approx(std::sqrt(b)));
  }
  CHECK(any);
}

TEST_CASE("a configuration file fills in, the command line wins") {
  const SceneFolder folder;
  write_text(folder / "run.toml",
             "# a run\npitch = 50\nazimuth = [0, 90]\nsize = \"16x24\"\nspacing = 0.5\nquiet = true\n"
             "aim = [0, 0, 0.5]\n");
  CHECK(folder.run({"box.obj", "--config", "run.toml", "-o", "a"}).code == 0);
  CHECK(folder.run({"box.obj", "--pitch", "50", "--azimuth", "0,90", "--size", "16x24", "--spacing",
                    "0.5", "--aim", "0,0,0.5", "-o", "b"}).code == 0);
  CHECK(folder.contents("a") == folder.contents("b"));

  // The other way to say pitch, and another azimuth.
  CHECK(folder.run({"box.obj", "--config", "run.toml", "--depression", "30", "--azimuth", "45", "-o",
                    "c"}).code == 0);
  CHECK(folder.run({"box.obj", "--pitch", "60", "--azimuth", "45", "--size", "16x24", "--spacing", "0.5",
                    "--aim", "0,0,0.5", "-o", "d"}).code == 0);
  CHECK(read_text(folder / "c.tif") == read_text(folder / "d.tif"));
}

TEST_CASE("a mistake in the configuration file is a bad input file") {
  const SceneFolder folder;
  write_text(folder / "unknown.toml", "pich = 50\n");
  write_text(folder / "value.toml", "pitch = 95\n");
  const Outcome missing = folder.run({"box.obj", "--config", "absent.toml"});
  CHECK(missing.code == 3);
  CHECK(is_error_line(missing.err, "absent.toml"));
  const Outcome unknown = folder.run({"box.obj", "--pitch", "45", "--config", "unknown.toml"});
  CHECK(unknown.code == 3);
  CHECK(is_error_line(unknown.err, "pich"));
  const Outcome value = folder.run({"box.obj", "--config", "value.toml"});
  CHECK(value.code == 2);
  CHECK(is_error_line(value.err, "95"));
}

TEST_CASE("outputs never replace what was read, however indirectly") {
  const SceneFolder folder;
  write_text(folder / "m.json", R"({"format": "sarnerf-materials", "version": 1, "materials": {"a": {"gamma0": 1}}})");
  write_text(folder / "scene.json",
             R"({"format": "sarnerf-scene", "version": 1, "meshes": [{"file": "box.obj"}], "materials_file": "m.json"})");
  write_text(folder / "c.json", "pitch = 45\n");
  const auto before = folder.contents();
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"scene.json", "--pitch", "45", "-o", "m"},
        {"scene.json", "--pitch", "45", "-o", "scene"},
        {"box.obj", "--config", "c.json", "-o", "c"}}) {
    auto all = arguments;
    all.insert(all.end(), {"--overwrite", "-q", "--size", "16x16"});
    const Outcome outcome = folder.run(all);
    CHECK(outcome.code == 2);
    INFO(outcome.err);
    CHECK(has(outcome.err, "would replace the input"));
    CHECK(folder.contents() == before);
  }
}

TEST_CASE("what makes no sense is refused as such, in one line") {
  const SceneFolder folder;
  const auto refuses = [&](const std::vector<std::string>& more, int code, const std::string& piece) {
    const Outcome outcome = folder.run(with({"box.obj", "--pitch", "45", "-q"}, more));
    INFO(piece << ": " << outcome.err);
    CHECK(outcome.code == code);
    CHECK(is_error_line(outcome.err, piece));
  };
  refuses({"--ground", "nope"}, 2, "unknown material 'nope'");
  refuses({"--ground", "canopy"}, 2, "translucent");
  refuses({"--altitude", "1e300"}, 2, "--altitude");
  refuses({"--slant-range", "1e-10"}, 2, "--slant-range");
  refuses({"--azimuth", "1e300"}, 2, "within a hundred turns");
  refuses({"-o", std::string(300, 'a')}, 1, "too long");
  refuses({"--pich", "45"}, 2, "--pitch?");
  const Outcome split = folder.run({"x\ny.obj", "--pitch", "45"});
  CHECK(split.code == 3);
  CHECK(is_error_line(split.err, "x\\x0ay.obj"));
  // Names need not be UTF-8, and then mean the same recipe when they are met again.
  std::filesystem::copy_file(folder / "box.obj", folder / "n\xff.obj");
  REQUIRE(folder.run({"n\xff.obj", "--pitch", "45", "-o", "n"}).code == 0);
  CHECK(has(folder.run({"n\xff.obj", "--pitch", "45", "-o", "n"}).err, "already done"));
  // Threads beyond all measure do no harm.
  CHECK(folder.run({"box.obj", "--pitch", "45", "-q", "-o", "t", "--threads", "4096"}).code == 0);
}
