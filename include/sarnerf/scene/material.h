// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

/// How matter answers the radar.
///
/// Opaque: γ(p, d) = gamma0 · texture(p) · max(0, −n·d)^exponent, the backscatter per area
/// perpendicular to the ray (thin shells: |n·d|). Translucent: a homogeneous medium with one-way
/// extinctions (1/m) going in and coming back, and scattering P (1/m).
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

/// The built-in table, with a source for each figure (docs/materials.md).
const std::vector<Material>& builtin_materials();

/// Materials by name. Later entries win over earlier ones of the same name.
class MaterialLibrary {
 public:
  MaterialLibrary();  ///< holds the built-in table

  /// Adds the materials of a "sarnerf-materials" JSON file and returns their names; InputError names file
  /// and key.
  std::vector<std::string> add_file(const std::filesystem::path& path);
  /// The same of such a file's text; `name` is what messages call it.
  std::vector<std::string> add_text(std::string_view text, const std::string& name);
  /// Adds the object under "materials" of a scene file; `where` goes into error messages.
  void add_json(std::string_view json_text, const std::string& where);
  void add(Material material);

  const Material* find(std::string_view name) const;

  /// As find(); throws InputError with `where`, the known names and the closest one when there is none.
  const Material& require(std::string_view name, const std::string& where) const;

  std::vector<std::string> names() const;  ///< sorted

 private:
  std::vector<Material> materials_;
};

}  // namespace sarnerf
