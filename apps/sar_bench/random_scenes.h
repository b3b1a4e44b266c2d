// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/scene/scene.h"

namespace sarnerf::app {
class Console;
}

namespace sarnerf::bench {

/// Kind of object in a generated scene: the seed's remainder modulo 4. The seeds 200 to 299 are shapes on which surfaces are judged;
/// their kind follows from the remainder modulo 5, in the order from `ring`.
enum class SceneKind {
  free_form = 0,
  solid = 1,
  building = 2,
  vehicle = 3,
  ring,      ///< with a hole that one can look through
  overhang,  ///< wider above than below, and to one side
  thin,      ///< with a plate and a wall two voxels of 0.15 m thick
  slanted,   ///< beams that lean against one another
  smooth,    ///< a bent tube of changing width, without an edge
};

inline constexpr std::uint64_t kFirstShape = 200, kEndOfShapes = 300;

SceneKind kind_of(std::uint64_t seed);

/// "free_form", "solid", "building", "vehicle", "ring", "overhang", "thin", "slanted", "smooth".
std::string_view name(SceneKind kind);

/// A closed mesh of one material. Triangles are counter-clockwise seen from outside.
struct ScenePiece {
  std::string group, material;  ///< names in the OBJ file
  std::vector<glm::dvec3> vertices_m;
  std::vector<glm::uvec3> triangles;
};

/// A generated object. No constant of learning was chosen on such objects: they test whether the constants hold for others.
///
/// Metres, Y up. The object stands on y = 0 and its box is centred over the origin. Coordinates are whole tenths of a
/// millimetre, as in the file. Pieces cut through each other; none has a face or an edge in common with another. A shape has one material.
struct RandomScene {
  std::string name;  ///< "101_solid"
  std::vector<ScenePiece> pieces;
  std::vector<Material> materials;  ///< of the pieces, four at most
  int turn_deg = 0;                 ///< about Y, from mesh to scene, so that no wall is along an axis of a learned grid
};

/// The scene of a seed, the same on every platform. Before it is turned:
///
/// | kind | longest horizontal extent (m) | height (m) |
/// |---|---|---|
/// | solid, free form | 7.5 to 11.5 | 2.5 to 7.5 |
/// | building | 7.5 to 11.7 | 3 to 8 |
/// | vehicle, its barrel included | 7 to 10 | 2 to 6 |
/// | shape | 6 to 10 | 2.5 to 6.5 |
///
/// Cost: milliseconds.
RandomScene random_scene(std::uint64_t seed);

/// The pieces as an OBJ file.
std::string obj_text(const RandomScene& scene);

/// The scene file beside scene.obj: placement and materials.
std::string scene_json_text(const RandomScene& scene);

struct ScenesOptions {
  std::string seeds;             ///< "111", "101,105", "101:109": numbers and ranges, last included
  std::filesystem::path output;  ///< folder
  bool overwrite = false, quiet = false, dry_run = false;
};

/// Writes scene.obj and scene.json of each seed into a folder of the scene's name below `output`, and prints the
/// paths of the scene files. Throws UsageError for invalid seeds and, before anything is written, if another file is
/// in the way. Leaves a file that has the same bytes as it is.
void run_scenes_command(const ScenesOptions& options, app::Console& console);

}  // namespace sarnerf::bench
