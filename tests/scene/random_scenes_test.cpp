// SPDX-License-Identifier: Apache-2.0
// What sar_bench scenes writes: closed meshes that look outward, of the sizes that its header promises.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "catch.h"
#include "files.h"
#include "random_scenes.h"

using namespace sarnerf;
using namespace sarnerf::bench;
using namespace sarnerf::test;

namespace {

/// Those of the ablation, fifteen of each kind, and six of each shape.
std::vector<std::uint64_t> tried_seeds() {
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t seed = 101; seed <= 115; ++seed) seeds.push_back(seed);
  for (std::uint64_t seed = 1000; seed < 1060; ++seed) seeds.push_back(seed);
  for (std::uint64_t seed = 200; seed < 230; ++seed) seeds.push_back(seed);
  return seeds;
}

/// Whether each edge is run through once in either direction: no border, and neighbours agree.
bool is_closed(const ScenePiece& piece) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const glm::uvec3& t : piece.triangles) {
    for (const auto& edge : {std::pair(t.x, t.y), std::pair(t.y, t.z), std::pair(t.z, t.x)}) {
      if (!edges.insert(edge).second) return false;
    }
  }
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) { return edges.contains({edge.second, edge.first}); });
}

glm::dvec3 area_vector_m2(const ScenePiece& piece, const glm::uvec3& t) {
  const glm::dvec3 a = piece.vertices_m[t.x];
  return 0.5 * glm::cross(piece.vertices_m[t.y] - a, piece.vertices_m[t.z] - a);
}

double least_area_m2(const ScenePiece& piece) {
  double least = std::numeric_limits<double>::infinity();
  for (const glm::uvec3& t : piece.triangles) least = std::min(least, glm::length(area_vector_m2(piece, t)));
  return least;
}

double signed_volume_m3(const ScenePiece& piece) {
  double volume = 0.0;
  for (const glm::uvec3& t : piece.triangles)
    volume += glm::dot(piece.vertices_m[t.x] - piece.vertices_m[0], area_vector_m2(piece, t)) / 3.0;
  return volume;
}

Box box_of(const RandomScene& scene) {
  Box box;
  for (const ScenePiece& piece : scene.pieces) {
    for (const glm::dvec3& p : piece.vertices_m) box.include(p);
  }
  return box;
}

bool within(double value, double least, double most) { return value >= least && value <= most; }

}  // namespace

TEST_CASE("A seed makes the same scene each time, and another one than other seeds") {
  std::set<std::string> meshes, scene_files;
  for (const std::uint64_t seed : tried_seeds()) {
    const RandomScene scene = random_scene(seed);
    CHECK(obj_text(scene) == obj_text(random_scene(seed)));
    CHECK(scene_json_text(scene) == scene_json_text(random_scene(seed)));
    // Without the first line, which names the seed.
    const std::string mesh = obj_text(scene);
    meshes.insert(mesh.substr(mesh.find('\n')));
    scene_files.insert(scene_json_text(scene));
  }
  CHECK(meshes.size() == tried_seeds().size());
  CHECK(scene_files.size() == tried_seeds().size());
}

TEST_CASE("Pieces of generated scenes are closed, look outward and have no degenerate triangle") {
  for (const std::uint64_t seed : tried_seeds()) {
    for (const ScenePiece& piece : random_scene(seed).pieces) {
      INFO(seed << " " << piece.group);
      CHECK(is_closed(piece));
      CHECK(least_area_m2(piece) > 1e-8);
      CHECK(signed_volume_m3(piece) > 0.0);
    }
  }
}

TEST_CASE("Generated scenes stand on y = 0 around the origin, in the sizes of their kinds") {
  for (const std::uint64_t seed : tried_seeds()) {
    const RandomScene scene = random_scene(seed);
    INFO(scene.name);
    const Box box = box_of(scene);
    CHECK(box.min.y == 0.0);
    CHECK(std::abs(box.centre().x) < 1e-3);
    CHECK(std::abs(box.centre().z) < 1e-3);
    const double length_m = std::max(box.size().x, box.size().z), height_m = box.size().y;
    switch (kind_of(seed)) {
      case SceneKind::solid:
      case SceneKind::free_form:
        CHECK(within(length_m, 7.499, 11.501));
        CHECK(within(height_m, 2.499, 7.501));
        break;
      case SceneKind::building:
        CHECK(within(length_m, 7.5, 11.7));
        CHECK(within(height_m, 3.0, 8.0));
        break;
      case SceneKind::vehicle:
        CHECK(within(length_m, 7.0, 10.0));
        CHECK(within(height_m, 2.0, 6.0));
        break;
      default:
        CHECK(within(length_m, 5.999, 10.001));
        CHECK(within(height_m, 2.499, 6.501));
    }
  }
}

TEST_CASE("The kind of a generated scene follows its seed, and its pieces the kind") {
  CHECK(random_scene(101).name == "101_solid");
  CHECK(random_scene(102).name == "102_building");
  CHECK(random_scene(103).name == "103_vehicle");
  CHECK(random_scene(104).name == "104_free_form");
  CHECK(random_scene(205).name == "205_ring");
  CHECK(random_scene(206).name == "206_overhang");
  CHECK(random_scene(207).name == "207_thin");
  CHECK(random_scene(208).name == "208_slanted");
  CHECK(random_scene(209).name == "209_smooth");
  std::map<std::string, int> n_with;  // scenes that have a group
  int n_checkered = 0;
  for (const std::uint64_t seed : tried_seeds()) {
    const RandomScene scene = random_scene(seed);
    INFO(scene.name);
    std::map<std::string, int> n_pieces;
    for (const ScenePiece& piece : scene.pieces) ++n_pieces[piece.group];
    for (const auto& [group, count] : n_pieces) ++n_with[group];
    switch (kind_of(seed)) {
      case SceneKind::solid: CHECK(within(double(scene.pieces.size()), 1, 3)); break;
      case SceneKind::building:
        CHECK(within(n_pieces["wall"], 2, 3));
        CHECK(n_pieces["roof"] == n_pieces["wall"]);
        break;
      case SceneKind::vehicle:
        CHECK(n_pieces["hull"] == 1);
        CHECK(within(n_pieces["wheel"], 4, 8));
        CHECK(n_pieces["cabin"] + n_pieces["turret"] == 1);
        break;
      case SceneKind::free_form:
        for (const ScenePiece& piece : scene.pieces) {
          CHECK(piece.vertices_m.size() == 2562);
          const auto n_on_ground =
              std::count_if(piece.vertices_m.begin(), piece.vertices_m.end(), [](const auto& p) { return p.y == 0.0; });
          CHECK(within(double(n_on_ground) / 2562.0, 0.09, 1.0 / 3.0));
        }
        break;
      default: {
        CHECK(scene.materials.size() == 1);
        // Closed: three edges for two triangles. Characteristic 0 for a ring, 2 for the others.
        const ScenePiece& first = scene.pieces.front();
        const auto n_vertices = static_cast<int>(first.vertices_m.size()), n_triangles = static_cast<int>(first.triangles.size());
        CHECK(n_vertices - n_triangles / 2 == (kind_of(seed) == SceneKind::ring ? 0 : 2));
      }
    }

    CHECK(within(double(scene.materials.size()), 1, 4));
    for (const ScenePiece& piece : scene.pieces) {
      CHECK(std::count_if(scene.materials.begin(), scene.materials.end(),
                          [&](const Material& m) { return m.name == piece.material; }) == 1);
    }
    for (const Material& material : scene.materials) {
      CHECK(within(material.gamma0, 0.3, 1.5));
      CHECK(within(material.exponent, 0.5, 2.5));
      if (material.texture.kind == Texture::Kind::none) continue;
      ++n_checkered;
      CHECK(within(material.texture.period_m, 0.6, 1.5));
      CHECK(within(material.texture.contrast, 0.2, 0.5));
    }
  }
  // What is drawn now and then occurs.
  for (const char* group : {"solid_1", "solid_2", "solid_3", "chimney", "porch", "cabin", "turret", "barrel", "mast", "body_2"}) {
    INFO(group);
    CHECK(n_with[group] > 0);
  }
  const auto n_scenes = static_cast<int>(tried_seeds().size());
  CHECK(within(n_checkered, n_scenes / 4, 3 * n_scenes / 4));
}

TEST_CASE("A generated scene loads as it was drawn: each piece a solid, nothing to repair or to warn of") {
  for (std::uint64_t seed = 101; seed <= 108; ++seed) {
    const RandomScene drawn = random_scene(seed);
    INFO(drawn.name);
    const ScratchFolder folder;
    folder.write("scene.obj", obj_text(drawn));
    const Scene loaded = load_scene(folder.write("scene.json", scene_json_text(drawn)), {});
    CHECK(loaded.report.notes.empty());
    CHECK(loaded.report.warnings.empty());
    CHECK(loaded.pieces.size() == drawn.pieces.size());
    CHECK(std::all_of(loaded.pieces.begin(), loaded.pieces.end(), [](const Piece& piece) { return piece.closed; }));
    CHECK(loaded.materials.size() == drawn.materials.size());
    for (const Material& material : drawn.materials) {
      const auto found = std::find_if(loaded.materials.begin(), loaded.materials.end(),
                                      [&](const Material& m) { return m.name == material.name; });
      REQUIRE(found != loaded.materials.end());
      CHECK(found->gamma0 == material.gamma0);
      CHECK(found->exponent == material.exponent);
      CHECK(found->texture.kind == material.texture.kind);
      CHECK(found->texture.contrast == material.texture.contrast);
    }
  }
}
