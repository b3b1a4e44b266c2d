// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "core/json_view.h"
#include "sarnerf/scene/scene.h"
#include "triangle_soup.h"

namespace sarnerf {

/// A value of a scene file or a materials file.
using SceneJson = JsonView<nlohmann::json>;

/// Such a file, parsed from its text. Throws InputError with its name, as parse_json() does.
class SceneDocument {
 public:
  SceneDocument(std::string_view text, const std::string& name);
  SceneDocument(const SceneDocument&) = delete;
  SceneDocument& operator=(const SceneDocument&) = delete;

  const SceneJson& root() const { return root_; }

 private:
  const nlohmann::json value_;
  const SceneJson root_;
};

/// One mesh file and its placement, from a `.json` scene or from the command line.
struct MeshEntry {
  std::filesystem::path file;
  std::string place;                             ///< for messages: "street.json: meshes[2]"
  UpAxis up = UpAxis::y;                         ///< of the mesh file
  double metres_per_unit = 1.0;                  ///< units and scale together
  glm::dmat4 world_from_object{1.0};             ///< rigid; object coordinates are metres with Y up
  std::optional<std::string> material;           ///< of faces that `materials` does not name
  std::map<std::string, std::string> materials;  ///< material or group of the file → library name
};

struct GroundEntry {
  std::string material;
  std::optional<double> height_m;
  std::string place;
};

/// A scene before any mesh is read.
struct SceneFile {
  std::vector<MeshEntry> meshes;
  std::optional<GroundEntry> ground;
  MaterialLibrary library;
  std::filesystem::path materials_file;  ///< named by the scene file; empty if none
  std::vector<std::string> given_materials;  ///< from --materials; a warning if the scene uses none
  std::string materials_source;  ///< origin of the user's materials; "" if there are none
};

/// Reads a "sarnerf-scene" JSON file, version 1:
///
///     {"format": "sarnerf-scene", "version": 1,
///      "up": "y",                             axes of this file's own numbers, and of meshes without "up"
///      "meshes": [{"file": "truck.obj",       relative to the scene file
///                  "up": "z", "units": "cm",  m, cm, mm, km, in, ft, or metres per unit as a number
///                  "scale": 2.5,              on top of the units
///                  "rotate_deg": [0, 90, 0],  about the scene's x, then y, then z axis; or
///                                             {"axis": [0, 1, 0], "angle": 90}
///                  "translate_m": [1, 2, 3],  after the rotation
///                  "material": "metal",       for all faces that "materials" does not name
///                  "materials": {"body": "metal"}}],   material or group in the mesh → library name
///      "materials_file": "more.json",         relative to the scene file
///      "materials": {…},                      as in a materials file; wins over it
///      "ground": {"material": "grass", "height_m": 0}}
///
/// Only "format", "version" and "meshes" are required; unknown keys are refused.
SceneFile read_scene_file(const std::filesystem::path& path);

/// The same for the text of such a file; `name` appears in messages, paths are relative to `folder`.
SceneFile parse_scene_file(std::string_view text, const std::string& name,
                           const std::filesystem::path& folder);

/// The transform that turns `up`-axis coordinates into world coordinates (Y up).
glm::dmat4 world_from_axes(UpAxis up);

/// The materials of an object whose keys are their names. Throws InputError for unknown keys, for values
/// without meaning, and for materials that are both opaque and translucent.
std::vector<Material> parse_materials(const SceneJson& materials);

/// Largest coordinate on any axis, so that squares and volumes stay in range.
inline constexpr double kFarthest_m = 1e12;

/// Throws InputError for coordinates beyond kFarthest_m, whose squares and volumes could overflow.
void require_reach(const MeshEntry& entry, const TriangleSoup& soup);

/// Warns of vertices stored in single precision so far from the origin that their rounding is visible.
void warn_about_precision(const MeshEntry& entry, const TriangleSoup& soup, SceneReport& report);

/// Warns if the scene's size suggests other units, and if the ground hides a third of the scene's height or more.
void warn_about_size(Scene& scene);

}  // namespace sarnerf
