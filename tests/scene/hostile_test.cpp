// SPDX-License-Identifier: Apache-2.0
// Files that are wrong: one clear line that names the place, and never a crash or a large allocation.
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <random>

#include "catch.h"
#include "files.h"
#include "readers/readers.h"
#include "solids.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::string refusal(const std::string& name, std::string_view text) {
  return message_of<InputError>([&] { load_text(name, text); });
}

/// All parts occur, and the message is one line.
bool says(const std::string& message, std::initializer_list<std::string_view> parts) {
  for (const std::string_view part : parts) {
    if (!contains(message, part)) {
      UNSCOPED_INFO("'" << part << "' is not in: " << message);
      return false;
    }
  }
  return !contains(message, "\n");
}

constexpr const char* kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

}  // namespace

TEST_CASE("Missing, empty and strange files") {
  const ScratchFolder folder;
  const auto load = [&](const std::filesystem::path& path) {
    return message_of<InputError>([&] { load_scene(path, {}); });
  };
  CHECK(says(load(folder.path() / "none.obj"), {"none.obj", "no such file"}));
  CHECK(says(load(folder.write("empty.stl", "")), {"empty.stl", "empty"}));
  CHECK(says(load(folder.write("mesh.dae", "x")), {"mesh.dae", ".obj, .ply, .stl, .off", ".dae"}));
  std::filesystem::create_directory(folder.path() / "folder.obj");
  CHECK(says(load(folder.path() / "folder.obj"), {"folder.obj", "a folder"}));
}

TEST_CASE("Pipes, devices and endings are refused before anything is opened") {
  const ScratchFolder folder;
  const auto refused = [&](const std::filesystem::path& path) {
    const std::string by_check = message_of<InputError>([&] { require_scene_file(path); });
    CHECK(message_of<InputError>([&] { load_scene(path, {}); }) != "");
    return by_check;
  };
  REQUIRE(::mkfifo((folder.path() / "pipe.obj").c_str(), 0600) == 0);
  CHECK(says(refused(folder.path() / "pipe.obj"), {"pipe.obj", "a pipe"}));
  CHECK(says(refused("/dev/zero"), {"/dev/zero", "a device"}));
  CHECK(says(refused(folder.path()), {"a folder"}));
  CHECK(says(refused(folder.write("mesh.dae", "x")), {"mesh.dae", ".obj", "'.dae'"}));
  for (const char* name : {"a.obj", "a.OBJ", "a.ply", "a.stl", "a.off", "a.json", "a.vdb"}) {
    CHECK_NOTHROW(require_scene_file(folder.write(name, "x")));
  }
}

TEST_CASE("A byte-order mark is skipped, UTF-16 refused, whatever the format") {
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"a.ply", std::string(kPlyHead) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
      {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"},
      {"a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                "endloop\nendfacet\nendsolid x\n"},
      {"a.json", R"({"format": "sarnerf-scene", "version": 1, "meshes": [], "ground": {"material": "grass"}})"}};
  for (const auto& [name, text] : files) {
    INFO(name);
    const auto n_triangles = load_text(name, text).mesh.triangles.size();
    CHECK(load_text(name, "\xef\xbb\xbf" + text).mesh.triangles.size() == n_triangles);
    std::string wide = "\xff\xfe", wide_without_mark;
    for (const char c : text) {
      wide += {c, '\0'};
      wide_without_mark += {'\0', c};
    }
    CHECK(says(refusal(name, wide), {name, "UTF-16"}));
    CHECK(says(refusal(name, wide_without_mark), {name, "UTF-16"}));
  }
  std::string binary(84 + 50, '\0');
  binary[80] = 1;
  const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::memcpy(binary.data() + 96, corners, sizeof corners);
  binary.replace(0, 3, "\xef\xbb\xbf");  // a header may begin with anything
  CHECK(load_text("a.stl", binary).mesh.triangles.size() == 1);
}

TEST_CASE("Lines that end by carriage returns, alone or doubled") {
  for (const std::string end : {"\r", "\r\n", "\r\r\n"}) {
    INFO(end.size());
    const auto with_ends = [&](std::string text) {
      for (std::size_t n = 0; (n = text.find('\n', n)) != std::string::npos; n += end.size()) text.replace(n, 1, end);
      return text;
    };
    CHECK(load_text("a.obj", with_ends("# a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")).mesh.triangles.size() == 1);
    CHECK(says(refusal("a.obj", with_ends("v 0 0 0\nv 1 x 0\n")), {"a.obj:2:", "'x'"}));
    CHECK(load_text("a.off", with_ends("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).mesh.triangles.size() == 1);
    CHECK(load_text("a.ply", with_ends(std::string(kPlyHead) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"))
              .mesh.triangles.size() == 1);
  }
}

TEST_CASE("JSON nested without end is refused by file and limit") {
  const std::size_t deep = 100'000;
  for (const std::string& text : {std::string(deep, '['), std::string(deep, '[') + std::string(deep, ']')}) {
    CHECK(says(refusal("a.json", text), {"a.json:1:", "64"}));
    const ScratchFolder folder;
    const auto path = folder.write("m.json", R"({"format": "sarnerf-materials", "version": 1, "materials": )" + text + "}");
    CHECK(says(message_of<InputError>([&] { MaterialLibrary().add_file(path); }), {"m.json:1:", "64"}));
  }
  std::string objects;
  for (std::size_t n = 0; n < deep; ++n) objects += "{\"a\":";
  CHECK(says(refusal("a.json", objects), {"a.json:1:", "64"}));
}

TEST_CASE("Names in a scene file that would tear a message or end a path early are refused") {
  const auto scene = [](const std::string& inside) {
    return R"({"format": "sarnerf-scene", "version": 1, )" + inside + "}";
  };
  for (const char* name : {"a\\nb.obj", "a.obj\\u0000.obj", ""}) {
    CHECK(says(refusal("s.json", scene(R"("meshes": [{"file": ")" + std::string(name) + R"("}])")),
               {"s.json: meshes[0].file", "the name of a file"}));
    CHECK(says(refusal("s.json", scene(R"("meshes": [], "materials_file": ")" + std::string(name) + "\"")),
               {"s.json: materials_file", "the name of a file"}));
  }
  CHECK(says(refusal("s.json", scene(R"("meshes": [], "a\nb": 1)")), {"unknown key 'a?b'"}));
  CHECK(says(refusal("s.json", scene(R"("meshes": [], "materials": {"a\nb": {"gamma0": -1}})")),
             {"materials.a?b.gamma0"}));
  const std::string message = refusal("s.json", scene("\"meshes\": [\"" + std::string(100'000, 'x')));
  CHECK(says(message, {"s.json", "JSON"}));
  CHECK(message.size() < 1000);
}

TEST_CASE("OBJ that cannot be used") {
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0\nf 1 2 3\n"),
             {"a.obj:2:", "three coordinates", "end of the line"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 x 0\n"), {"a.obj:2:", "'x'"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"),
             {"a.obj:2:", "finite", "nan"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 1e999 0\n"), {"a.obj:2:", "finite", "inf"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
             {"a.obj:4:", "vertex 9", "1 to 3"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n"), {"a.obj:4:", "vertex -4"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"), {"a.obj:4:", "vertex 0"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 y\n"),
             {"a.obj:4:", "vertex index", "'y'"}));
  CHECK(
      says(refusal("a.obj", "v 0 0 0\nv 1 0 0\n"), {"a.obj", "expected triangles", "2 vertices"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n"), {"fewer than three corners"}));
  CHECK(says(refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), {"triangles with area"}));
  CHECK(says(refusal("a.obj", std::string("\0\x01\x02zzz\n", 7)), {"expected triangles"}));
  CHECK(says(refusal("a.obj", "v 1e200 0 0\nv 1 0 0\nv 2 1 0\nf 1 2 3\n"), {"1e+200", "--units"}));
}

TEST_CASE("PLY that cannot be used") {
  const std::string head = kPlyHead;
  CHECK(says(refusal("a.ply", "plx\n"), {"a.ply:1:", "'ply'"}));
  CHECK(says(refusal("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"),
             {"end_header", "end of the file"}));
  CHECK(says(refusal("a.ply", "ply\nformat ebcdic 1.0\nend_header\n"), {"a.ply:2:", "'ebcdic'"}));
  CHECK(says(refusal("a.ply", "ply\nformat ascii 1.0\nelement vertex -3\nend_header\n"),
             {"a.ply:3:", "'-3'"}));
  CHECK(says(refusal("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty real x\n"),
             {"a.ply:4:", "'real'"}));
  CHECK(says(refusal("a.ply", head + "0 0 0\n1 0 0\n0 1 0\n"), {"face 0", "end of the file"}));
  CHECK(says(refusal("a.ply", head + "0 0 0\n1 0 0\n0 1 q\n3 0 1 2\n"),
             {"a.ply:12:", "vertex 2", "'q'"}));
  CHECK(says(refusal("a.ply", head + "0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n"),
             {"vertex 2", "finite", "inf"}));
  CHECK(says(refusal("a.ply", head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
             {"face 0", "vertex 3", "0 to 2"}));
  CHECK(says(refusal("a.ply", head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), {"face 0", "vertex -1"}));
  CHECK(says(refusal("a.ply", head + "0 0 0\n1 0 0\n0 1 0\n200 0 1 2\n"), {"face 0", "200"}));
  CHECK(says(refusal("a.ply",
                     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                     "property float z\nend_header\n0 0 0\n"),
             {"expected triangles", "1 vertex"}));
}

TEST_CASE("Counts are not believed") {
  const std::string huge = "18446744073709551615", large = "4000000000";
  CHECK(says(refusal("a.ply",
                     "ply\nformat binary_little_endian 1.0\nelement vertex " + large +
                         "\nproperty double x\nproperty double y\nproperty double z\nend_header\n"),
             {"promises 4,000,000,000", "0 bytes follow"}));
  CHECK(says(refusal("a.ply", "ply\nformat ascii 1.0\nelement vertex " + huge + "\nend_header\n"),
             {huge}));
  CHECK(says(refusal("a.ply",
                     "ply\nformat ascii 1.0\nelement vertex 4000000000\nelement face 1\n"
                     "property list int int vertex_indices\nend_header\n3 0 1 2\n"),
             {"a.ply"}));
  CHECK(says(refusal("a.off", "OFF\n" + large + " 1 0\n0 0 0\n"), {"promises 4,000,000,000"}));
  CHECK(says(refusal("a.off", "OFF\n1 " + large + " 0\n0 0 0\n"), {"promises 4,000,000,000"}));
  std::string stl(80, ' ');
  stl += "\xff\xff\xff\x7f";
  CHECK(says(refusal("a.stl", stl), {"2,147,483,647 triangles", "found 84"}));
}

TEST_CASE("STL and OFF that cannot be used") {
  CHECK(says(refusal("a.stl", "hello"), {"84", "5 bytes"}));
  CHECK(says(
      refusal("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"),
      {"a.stl:5:", "'endfacet'", "end of the file"}));
  CHECK(says(refusal("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\n"),
             {"a.stl:4:", "finite"}));
  CHECK(says(refusal("a.stl", "solid x\nendsolid x\n"), {"expected triangles"}));
  CHECK(says(refusal("a.off", "OFX\n"), {"a.off:1:", "'OFX'"}));
  CHECK(says(refusal("a.off", "4OFF\n1 1 0\n"), {"four-dimensional"}));
  CHECK(says(refusal("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"), {"a.off"}));
  CHECK(says(refusal("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"),
             {"a.off:6:", "vertex 7", "0 to 2"}));
  CHECK(says(refusal("a.off", "OFF\n3 1 0\n0 0 0\n1 0 z\n0 1 0\n3 0 1 2\n"), {"a.off:4:", "'z'"}));
}

TEST_CASE("Damaged bytes are refused or read, never worse") {
  // A fuzzer in miniature: cuts and flips of good files of each kind.
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 1.0);
  const std::string ply = std::string(kPlyHead) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  binary += std::string(36, '\x10') + "\x03" + std::string("\0\0\0\0\1\0\0\0\2\0\0\0", 12);
  const std::string stl =
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid a\n";
  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.obj", obj.text()}, {"a.ply", ply}, {"b.ply", binary}, {"a.stl", stl}, {"a.off", off}};

  std::mt19937 random(7);
  int n_read = 0, n_refused = 0;
  for (const auto& [name, good] : files) {
    for (int round = 0; round < 400; ++round) {
      std::string bytes = good.substr(0, round % 2 ? good.size() : random() % good.size());
      for (int flips = round % 5; flips > 0 && !bytes.empty(); --flips) {
        bytes[random() % bytes.size()] = static_cast<char>(random());
      }
      try {
        const TriangleSoup soup =
            read_mesh(name, MeshSource{bytes, name, MemoryBudget{}, Monitor{}});
        for (const glm::uvec3& t : soup.triangles) {
          REQUIRE(std::max({t.x, t.y, t.z}) < soup.vertices.size());
        }
        ++n_read;
      } catch (const InputError&) {
        ++n_refused;
      }
    }
  }
  CHECK(n_read > 0);
  CHECK(n_refused > 0);
}

TEST_CASE("More memory than allowed is refused before it is taken") {
  ObjBuilder obj;
  for (int n = 0; n < 200; ++n) obj.cube({2.0 * n, 0, 0}, 1.0);
  LoadOptions options;
  options.max_memory_bytes = 300'000;
  const std::string message =
      message_of<UsageError>([&] { load_text("big.obj", obj.text(), options); });
  CHECK(says(message, {"big.obj", "2,400 triangles", "300 kB", "enough for about"}));
  options.max_memory_bytes = 1000;
  CHECK(says(message_of<UsageError>([&] { load_text("big.obj", obj.text(), options); }),
             {"holding the file"}));
  options.max_memory_bytes = 100'000'000;
  CHECK(load_text("big.obj", obj.text(), options).pieces.size() == 200);
}

TEST_CASE("Orienting a tangle takes more, and is refused by itself") {
  ObjBuilder obj;
  for (int n = 0; n < 200; ++n) {
    const int first = 8 * n + 1;
    for (int corner = 0; corner < 8; ++corner) {
      obj.vertex(cube_corner(corner, {2.0 * n, 0, 0}, 1.0));
    }
    for (const auto& f : kCubeFaces) {
      const bool flip = f[0] == 4;
      obj.triangle(first + f[0], first + f[flip ? 2 : 1], first + f[flip ? 1 : 2]);
    }
  }
  LoadOptions options;
  options.max_memory_bytes = 700'000;
  CHECK(says(message_of<UsageError>([&] { load_text("m.obj", obj.text(), options); }),
             {"m.obj", "2,400 triangles", "oriented oppositely", "700 kB"}));
  CHECK(load_text("m.obj", obj.text()).pieces.size() == 200);
}

TEST_CASE("A stop is honoured, progress is told") {
  ObjBuilder obj;
  obj.cube({0, 0, 0}, 1.0);
  LoadOptions options;
  std::vector<std::string> stages;
  options.monitor.progress = [&](std::string_view stage, std::uint64_t, std::uint64_t) {
    stages.emplace_back(stage);
  };
  load_text("cube.obj", obj.text(), options);
  CHECK(std::count(stages.begin(), stages.end(), "reading") > 0);
  CHECK(std::count(stages.begin(), stages.end(), "repairing") > 0);
  const std::atomic<bool> stop = true;
  options.monitor.stop = &stop;
  CHECK_THROWS_AS(load_text("cube.obj", obj.text(), options), Interrupted);
}
