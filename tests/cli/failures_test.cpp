// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "catch.h"
#include "program.h"

TEST_CASE("usage errors: exit code 2, one line, nothing written") {
  const std::vector<std::pair<std::vector<std::string>, std::string>> commands = {
      {{}, "SCENE"},
      {{"box.obj"}, "--pitch"},
      {{"box.obj", "--pitch", "0"}, "between 0 and 90"},
      {{"box.obj", "--pitch", "90"}, "between 0 and 90"},
      {{"box.obj", "--pitch", "-10"}, "between 0 and 90"},
      {{"box.obj", "--depression", "90"}, "--depression"},
      {{"box.obj", "--pitch", "80:100:5"}, "found 90"},
      {{"box.obj", "--pitch", "45", "--depression", "17"}, "contradict"},
      {{"box.obj", "--pitch", "forty"}, "forty"},
      {{"box.obj", "--pitch", "45", "--azimuth", "0:350"}, "0:350:10"},
      {{"box.obj", "--pitch", "45", "--altitude", "1000", "--slant-range", "1000"}, "--slant-range"},
      {{"box.obj", "--pitch", "45", "--altitude", "-5"}, "--altitude"},
      {{"box.obj", "--pitch", "45", "--altitude", "1"}, "radar"},
      {{"box.obj", "--pitch", "45", "--look", "up"}, "--look"},
      {{"box.obj", "--pitch", "45", "--size", "0x5"}, "--size"},
      {{"box.obj", "--pitch", "45", "--spacing", "0"}, "--spacing"},
      {{"box.obj", "--pitch", "45", "--units", "parsec"}, "--units"},
      {{"box.obj", "--pitch", "45", "--scale", "0"}, "--scale"},
      {{"box.obj", "--pitch", "45", "--aim", "1,2"}, "--aim"},
      {{"box.obj", "--pitch", "45", "--elevations", "0"}, "--elevations"},
      {{"box.obj", "--pitch", "45", "--sub-rows", "1.5"}, "--sub-rows"},
      {{"box.obj", "--pitch", "45", "--integrator", "best"}, "exact"},
      {{"box.obj", "--pitch", "45", "--engine", "quantum"}, "surface"},
      {{"box.obj", "--pitch", "45", "--engine", "surface", "--voxel-size", "0.1"}, "--voxel-size"},
      {{"box.obj", "--pitch", "45", "--voxel-size", "0"}, "--voxel-size"},
      {{"box.obj", "--pitch", "45", "--voxel-size", "1e-12"}, "voxels"},
      {{"box.obj", "--pitch", "45", "--voxel-size", "0.0001", "--max-memory", "1G"}, "--voxel-size"},
      {{"box.obj", "--pitch", "45", "--voxel-size", "1e-7"}, "MiB that are available; use --voxel-size"},
      {{"box.obj", "--pitch", "45", "--save-volume", "box.txt"}, ".vdb"},
      {{"box.obj", "--pitch", "45", "--calibration", "uncalibrated"}, "--calibration"},
      {{"box.obj", "--pitch", "45", "--quantity", "phase"}, "--quantity"},
      {{"box.obj", "--pitch", "45", "--resolution", "0"}, "--resolution"},
      {{"box.obj", "--pitch", "45", "--resolution", "nan"}, "--resolution"},
      {{"box.obj", "--pitch", "45", "--resolution", "0.3", "--window", "taylor:-35"}, "under-samples"},
      {{"box.obj", "--pitch", "45", "--window", "hann"}, "--resolution"},
      {{"box.obj", "--pitch", "45", "--resolution", "1", "--window", "triangle"}, "taylor:-35"},
      {{"box.obj", "--pitch", "45", "--looks", "0.5"}, "--looks"},
      {{"box.obj", "--pitch", "45", "--looks", "nan"}, "--looks"},
      {{"box.obj", "--pitch", "45", "--looks", "1e6"}, "--looks"},
      {{"box.obj", "--pitch", "45", "--nesz", "nan"}, "--nesz"},
      {{"box.obj", "--pitch", "45", "--nesz", "quiet"}, "--nesz"},
      {{"box.obj", "--pitch", "45", "--seed", "-1"}, "--seed"},
      {{"box.obj", "--pitch", "45", "--threads", "0"}, "--threads"},
      {{"box.obj", "--pitch", "45", "--max-memory", "lots"}, "--max-memory"},
      {{"box.obj", "--pitch", "45", "--no-such-option"}, "--no-such-option"},
      {{"box.obj", "second.obj", "--pitch", "45"}, "second.obj"},
      {{"box.obj", "--pitch", "45", "--calibration", "sigma0", "--ground-height", "20000"}, "--ground-height"},
  };
  const SceneFolder folder;
  const auto before = folder.contents();
  for (const auto& [arguments, piece] : commands) {
    const Outcome outcome = folder.run(arguments);
    INFO(arguments.size() << " arguments, last: " << (arguments.empty() ? "" : arguments.back()));
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK(has(outcome.err, piece));
    CHECK(is_error_line(outcome.err.substr(outcome.err.find("sar_render: error: ")), piece));
    CHECK(outcome.out.empty());
  }
  CHECK(folder.contents() == before);
}

TEST_CASE("bad input files: exit code 3, one line, nothing written") {
  const SceneFolder folder;
  write_text(folder / "empty.obj", "");
  write_text(folder / "text.obj", "this is no mesh\n");
  write_text(folder / "index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  write_text(folder / "nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  write_text(folder / "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  write_text(folder / "cut.json", "{\"format\": \"sarnerf-scene\"");
  write_text(folder / "mesh.doc", "");
  const auto before = folder.contents();
  for (const char* mesh : {"absent.obj", "empty.obj", "text.obj", "index.obj", "nan.obj", "points.obj",
                           "cut.json", "mesh.doc", "."}) {
    const Outcome outcome = folder.run({mesh, "--pitch", "45", "-o", "out"});
    INFO(mesh << ": " << outcome.err);
    CHECK(outcome.code == 3);
    CHECK(is_error_line(outcome.err, ""));
    CHECK(outcome.out.empty());
  }
  const Outcome material = folder.run({"box.obj", "--pitch", "45", "--ground", "cheese"});
  INFO(material.err);
  CHECK(material.code != 0);
  CHECK(is_error_line(material.err, "cheese"));
  CHECK(folder.run({"box.obj", "--pitch", "45", "--materials", "absent.json"}).code == 3);
  CHECK(folder.contents() == before);
}

TEST_CASE("pipes, devices and JSON without end: exit code 3 at once") {
  const SceneFolder folder;
  REQUIRE(::mkfifo((folder / "pipe.obj").c_str(), 0600) == 0);
  write_text(folder / "deep.json", std::string(100'000, '['));
  const std::vector<std::pair<std::vector<std::string>, std::string>> commands = {
      {{"pipe.obj", "--pitch", "45"}, "a pipe"},
      {{"/dev/zero", "--pitch", "45"}, "a device"},
      {{"box.obj", "--pitch", "45", "--materials", "/dev/zero"}, "a device"},
      {{"box.obj", "--pitch", "45", "--materials", "pipe.obj"}, "a pipe"},
      {{"deep.json", "--pitch", "45"}, "deep.json:1: expected at most 64"},
      {{"box.obj", "--pitch", "45", "--materials", "deep.json"}, "deep.json:1: expected at most 64"},
  };
  for (const auto& [arguments, piece] : commands) {
    const Outcome outcome = folder.run(arguments);
    INFO(arguments.front() << " " << arguments.back() << ": " << outcome.err);
    CHECK(outcome.code == 3);
    CHECK(is_error_line(outcome.err, piece));
  }
}

TEST_CASE("pixels beyond the finite numbers: exit code 4") {
  const SceneFolder folder;
  write_text(folder / "bright.json",
             R"({"format":"sarnerf-materials","version":1,"materials":{"default":{"gamma0":1e300}}})");
  const Outcome outcome = folder.run({"box.obj", "--pitch", "45", "--materials", "bright.json"});
  INFO(outcome.err);
  CHECK(outcome.code == 4);
  CHECK(has(outcome.err, "not finite"));
  CHECK_FALSE(std::filesystem::exists(folder / "box_sar.tif"));
}

TEST_CASE("output that cannot be written: exit code 1, one line") {
  const SceneFolder folder;
  write_text(folder / "file", "");
  for (const char* azimuth : {"0", "0,90"}) {
    for (const char* output : {"file/below", "file/below/deeper"}) {
      const Outcome outcome =
          folder.run({"box.obj", "--pitch", "45", "--azimuth", azimuth, "-o", output});
      INFO(outcome.err);
      CHECK(outcome.code == 1);
      CHECK(is_error_line(outcome.err, "file"));
    }
  }
  const Outcome in_the_way = folder.run({"box.obj", "--pitch", "45", "--azimuth", "0,90", "-o", "file"});
  CHECK(in_the_way.code == 2);
  CHECK(is_error_line(in_the_way.err, "file"));
}

TEST_CASE("a disk that fills up: exit code 1, nothing half-written") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Outcome single = sar_render({"box.obj", "--pitch", "45", "--size", "64x64", "-q"},
                                    {.folder = folder.path(), .max_file_bytes = 10000});
  INFO(single.err);
  CHECK(single.code == 1);
  CHECK(is_error_line(single.err, "box_sar.tif"));
  CHECK(folder.contents() == before);

  const Outcome sweep =
      sar_render({"box.obj", "--pitch", "45", "--azimuth", "0:90:10", "--size", "64x64", "-q", "-o", "s"},
                 {.folder = folder.path(), .max_file_bytes = 10000});
  CHECK(sweep.code == 1);
  CHECK(is_error_line(sweep.err, ".tif"));
  CHECK(folder.contents("s").size() == 2);  // the recipe and its checksum, with which the same command continues

  const Outcome again =
      folder.run({"box.obj", "--pitch", "45", "--azimuth", "0:90:10", "--size", "64x64", "-q", "-o", "s"});
  CHECK(again.code == 0);
  CHECK(folder.contents("s").size() == 3 + 2 * 10);  // recipe, manifest, checksums; images and pictures
}

TEST_CASE("a full stdout is a failure") {
  const SceneFolder folder;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--help"}, {"box.obj", "--pitch", "45"}}) {
    const Outcome outcome = sar_render(arguments, {.folder = folder.path(), .out = "/dev/full"});
    CHECK(outcome.code == 1);
    CHECK(has(outcome.err, "stdout"));
  }
}

TEST_CASE("more memory than allowed: exit code 2, saying what would fit") {
  const SceneFolder folder;
  const auto before = folder.contents();
  const Outcome image =
      folder.run({"box.obj", "--pitch", "45", "--size", "30000x30000", "--max-memory", "1G", "-q"});
  CHECK(image.code == 2);
  CHECK(is_error_line(image.err, "would fit"));
  const Outcome rays = folder.run({"box.obj", "--pitch", "45", "--size", "64x64", "--elevations",
                                   "100000000", "--max-memory", "1G", "-q"});
  INFO(rays.err);
  CHECK(rays.code == 2);
  CHECK(is_error_line(rays.err, "--max-memory"));
  CHECK(has(rays.err, "fewer --elevations"));
  const Outcome alone = folder.run({"box.obj", "--pitch", "45", "--size", "64x64", "--elevations",
                                    "100000000", "--max-memory", "1G", "-q", "--threads", "1"});
  CHECK(is_error_line(alone.err, "on 1 thread needs"));
  CHECK_FALSE(has(alone.err, "fewer --threads"));
  CHECK_FALSE(has(alone.err, "or --threads"));
  const Outcome program = folder.run({"box.obj", "--pitch", "45", "--max-memory", "1M", "-q"});
  CHECK(program.code == 2);
  CHECK(is_error_line(program.err, "--max-memory"));
  CHECK(folder.contents() == before);
}

TEST_CASE("what the machine does not have is refused before the work, without --max-memory too") {
  const SceneFolder folder;
  write_text(folder / "mm.obj", "v -5000 0 -5000\nv 5000 0 -5000\nv 5000 0 5000\nv -5000 0 5000\nv -5000 10000 -5000\n"
                                "v 5000 10000 -5000\nv 5000 10000 5000\nv -5000 10000 5000\n"
                                "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n");
  const auto before = folder.contents();
  // 10 m in millimetres: two thousand million pixels, which no reader takes, whatever the machine has.
  for (const char* more : {"-q", "--dry-run", "--explain", "--overwrite"}) {
    const Outcome cube = folder.run({"mm.obj", "--pitch", "45", more});
    INFO(cube.err);
    CHECK(cube.code == 2);
    CHECK(has(cube.err, "the scene measures 10 km"));
    CHECK(has(cube.err, "--units mm"));
  }
  CHECK(folder.run({"mm.obj", "--pitch", "45", "--max-memory", "none", "-q"}).code == 2);
  CHECK(folder.run({"mm.obj", "--pitch", "45", "--units", "mm", "--dry-run"}).code == 0);
  // A size that was asked for is nobody's unit.
  const Outcome size = folder.run({"box.obj", "--pitch", "45", "--size", "60000x60000", "-q"});
  INFO(size.err);
  CHECK(size.code == 2);
  CHECK((has(size.err, "would fit") || has(size.err, "are possible")));
  CHECK_FALSE(has(size.err, "units"));
  // Every product counts: what fits alone does not with all layers, with speckle, or nine times over in a sweep.
  const std::vector<std::string> base = {"box.obj", "--pitch", "45", "--size", "4000x4000", "-q", "--dry-run", "--threads", "1",
                                         "--max-memory", "500M"};
  CHECK(folder.run(base).code == 0);
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--layers", "all"}, {"--looks", "1", "--nesz", "-20", "--resolution", "1"}, {"--azimuth", "0:350:10"}}) {
    const Outcome refused = folder.run(with(base, more));
    INFO(more.front() << ": " << refused.err);
    CHECK(refused.code == 2);
    CHECK(is_error_line(refused.err, "--max-memory allows 500 MiB"));
  }
  CHECK(folder.contents() == before);
}

TEST_CASE("the memory that is announced is what is taken: not less, and not half as much again") {
  const SceneFolder folder;
  const auto expected_over_peak = [&](std::vector<std::string> arguments, const char* report) {
    arguments.insert(arguments.begin(), {"box.obj", "--pitch", "45", "--spacing", "0.01", "-q", "--threads", "1", "-o", "m"});
    REQUIRE(folder.run(arguments).code == 0);
    const auto memory = nlohmann::json::parse(read_text(folder / report)).at("memory_bytes");
    std::filesystem::remove_all(folder / "m");
    for (const char* ending : {"m.tif", "m.json", "m.png"}) std::filesystem::remove(folder / ending);
    return memory.at("expected").get<double>() / memory.at("peak").get<double>();
  };
  const std::vector<std::pair<std::vector<std::string>, const char*>> renders = {
      {{"--size", "3000x3000"}, "m.report.json"},
      {{"--size", "2000x2000", "--ground", "grass", "--layers", "all", "--overwrite"}, "m.report.json"},
      {{"--size", "3000x3000", "--looks", "1", "--nesz", "-20", "--ground", "grass", "--overwrite"}, "m.report.json"},
      {{"--size", "3000x3000", "--resolution", "0.03", "--overwrite"}, "m.report.json"},
      {{"--size", "3000x3000", "--error", "5%", "--overwrite"}, "m.report.json"},
      {{"--size", "1500x1500", "--azimuth", "0:330:30"}, "m/dataset.report.json"}};
  for (const auto& [arguments, report] : renders) {
    const double ratio = expected_over_peak(arguments, report);
    INFO(arguments.size() << " arguments, last " << arguments.back());
    CHECK(ratio > 0.97);
    CHECK(ratio < 1.5);
  }
}
