// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// Spatial modulation of a material's brightness, in the coordinates of the object it covers.
struct Texture {
  enum class Kind { none, checker };
  Kind kind = Kind::none;
  double period_m = 1.0;  ///< side of one square
  double contrast = 0.0;  ///< factor 1 ± contrast
  /// Corner of a square. A quarter period by default, so that the faces of objects drawn on whole
  /// metres do not lie on borders between squares.
  std::optional<glm::dvec3> origin_m;

  glm::dvec3 effective_origin_m() const { return origin_m.value_or(glm::dvec3(0.25 * period_m)); }

  /// Factor on γ at a point in object coordinates: 1 + contrast (−1)^Σ⌊(p − origin)/period⌋.
  double factor(const glm::dvec3& object_m) const;
};

/// Radar response of a material.
///
/// Opaque: γ(p, d) = gamma0 · texture(p) · max(0, −n·d)^exponent, the backscatter per area
/// perpendicular to the ray (thin shells: |n·d|). Translucent: a homogeneous medium with one-way
/// extinctions (1/m) on the way in and on the way back, and scattering P (1/m).
struct Material {
  std::string name = "default";
  bool opaque = true;
  double gamma0 = 1.0;
  double exponent = 1.0;
  Texture texture;
  double extinction_per_m = 0.0;
  double extinction_back_per_m = 0.0;
  double scattering_per_m = 0.0;
};

/// The built-in table, with a source for each figure (docs/guide/materials.md).
const std::vector<Material>& builtin_materials();

/// Materials by name. A later entry replaces an earlier one of the same name.
class MaterialLibrary {
 public:
  MaterialLibrary();  ///< holds the built-in table

  /// Adds the materials of a "sarnerf-materials" JSON file and returns their names; InputError names file
  /// and key.
  std::vector<std::string> add_file(const std::filesystem::path& path);
  /// The same for the text of such a file; `name` appears in messages.
  std::vector<std::string> add_text(std::string_view text, const std::string& name);
  /// Adds the object under "materials" of a scene file; `where` goes into error messages.
  void add_json(std::string_view json_text, const std::string& where);
  void add(Material material);

  const Material* find(std::string_view name) const;

  /// As find(); throws InputError with `where`, the known names and the closest one when there is none.
  const Material& require(std::string_view name, const std::string& where) const;

  /// The material of `--ground NAME`, which is opaque. Throws UsageError for an unknown or translucent one: the command line is
  /// wrong, and no file.
  const Material& require_ground(const std::string& name) const;

  std::vector<std::string> names() const;  ///< sorted

 private:
  std::vector<Material> materials_;
};

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

/// One mesh file placed in the scene. Textures use its coordinates: metres, before placement.
struct Object {
  std::string name;
  glm::dmat4 object_from_world{1.0};
};

/// Infinite horizontal plane.
struct Ground {
  std::uint32_t material = 0;
  double height_m = 0.0;
};

/// Actions of loading and repair, for the log and for --explain: one line each; empty if there were none.
struct SceneReport {
  std::vector<std::filesystem::path> files;  ///< every file that was read, for fingerprints
  std::vector<std::string> notes;     ///< repairs and assumptions
  std::vector<std::string> warnings;  ///< what the user should check
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
  std::optional<std::string> ground_material;          ///< "none" removes a scene file's ground
  std::optional<double> ground_height_m;               ///< default: the scene's lowest height
  bool repair = true;
  std::uint64_t max_memory_bytes = 0;                  ///< 0: unlimited
  Monitor monitor;
};

/// Throws InputError for a path that is not a regular file or does not end in .obj, .ply, .stl, .off, .json or
/// .vdb. Opens nothing, so pipes and devices do no harm.
void require_scene_file(const std::filesystem::path& path);

/// Reads OBJ, PLY, STL, OFF or a `.json` scene, repairs and orients it.
/// Throws InputError with file and position for anything that is not a usable scene.
Scene load_scene(const std::filesystem::path& path, const LoadOptions& options);

/// Part of the scene that a face or voxel belongs to. Values are those of the `component` grid of a volume.
enum class Component : std::uint8_t { none = 0, ground = 1, wall = 2, roof = 3, other = 4 };

/// "none", "ground", "wall", "roof", "other".
std::string_view name(Component component);

/// The component of the first known word, a whole word in any case: ground, floor, terrain, road, field,
/// pavement, street, grass, lawn, soil, sand, water | wall, walls, facade, side | roof, roofs, top; none if
/// there is no such word.
Component component_from_words(std::string_view words);

/// The component of each triangle, from its group's name, else from its material's name; else a face whose
/// normal points more than 45° above the horizon is roof and any other face wall. Translucent material is other.
std::vector<Component> components_of_triangles(const Scene& scene);

}  // namespace sarnerf
