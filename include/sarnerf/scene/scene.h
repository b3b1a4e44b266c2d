// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/geometry/box.h"
#include "sarnerf/scene/material.h"

namespace sarnerf {

/// Triangles in world coordinates. Triangles of closed pieces are counter-clockwise seen from outside.
struct Mesh {
  std::vector<glm::dvec3> vertices_m;
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> material;  ///< per triangle, index into Scene::materials
  std::vector<std::uint32_t> piece;     ///< per triangle, index into Scene::pieces
  std::vector<std::uint32_t> group;     ///< per triangle, index into Scene::groups
};

/// A connected part of the mesh after repair. A cavity belongs to the solid around it; faces of opaque and
/// of translucent materials, or of different translucent ones, never share a piece.
struct Piece {
  bool closed = false;       ///< bounds a volume; otherwise a thin shell, seen from both sides
  std::uint32_t object = 0;  ///< index into Scene::objects
};

/// One mesh file placed in the scene. Textures live in its coordinates: metres, before placement.
struct Object {
  std::string name;
  glm::dmat4 object_from_world{1.0};
};

/// Infinite horizontal plane.
struct Ground {
  std::uint32_t material = 0;
  double height_m = 0.0;
};

/// What loading and repair did, for the log and for --explain: one line each, empty when nothing.
struct SceneReport {
  std::vector<std::filesystem::path> files;  ///< every file that was read, for fingerprints
  std::vector<std::string> notes;     ///< what was mended or assumed
  std::vector<std::string> warnings;  ///< what the user should look at
  double read_s = 0.0;
  double repair_s = 0.0;
};

struct Scene {
  Mesh mesh;
  std::vector<Piece> pieces;
  std::vector<Object> objects;
  std::vector<std::string> groups;
  std::vector<Material> materials;  ///< only those in use
  std::optional<Ground> ground;
  Box box;  ///< of the mesh, world coordinates
  SceneReport report;
};

enum class UpAxis { y, z };

struct LoadOptions {
  UpAxis up = UpAxis::y;
  double units_m = 1.0;  ///< metres per file unit
  double scale = 1.0;    ///< extra factor on top of the units
  std::filesystem::path materials_file;                ///< empty: built-in table only
  std::optional<std::string> ground_material;          ///< "none" overrules a scene file's ground
  std::optional<double> ground_height_m;               ///< default: the scene's lowest height
  bool repair = true;
  std::uint64_t max_memory_bytes = 0;                  ///< 0: unlimited
  Monitor monitor;
};

/// Throws InputError for a path that is no regular file, or whose ending no reader knows: .obj, .ply, .stl,
/// .off, .json, .vdb. Opens nothing, so pipes and devices do no harm.
void require_scene_file(const std::filesystem::path& path);

/// Reads OBJ, PLY, STL, OFF or a `.json` scene, repairs and orients it.
/// Throws InputError with file and place for anything that is not a usable scene.
Scene load_scene(const std::filesystem::path& path, const LoadOptions& options);

}  // namespace sarnerf
