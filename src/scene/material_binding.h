// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "sarnerf/scene/scene.h"
#include "scene_file.h"
#include "triangle_soup.h"

namespace sarnerf {

/// Decides which material of the library covers each face, and collects those in use. Materials that the
/// user names must exist; names that come with a mesh are looked up, and what is not found is "default".
class MaterialBinding {
 public:
  MaterialBinding(const SceneFile& file, SceneReport& report) : file_(file), report_(report) {}

  /// Replaces soup.material by indices into materials().
  void bind(const MeshEntry& entry, TriangleSoup& soup);

  /// Index of a material that the user named at `place`; throws InputError when there is none.
  std::uint32_t require(const std::string& name, const std::string& place);

  const std::vector<Material>& materials() const { return materials_; }

  /// Names under which materials were looked up in the library.
  const std::set<std::string>& asked_for() const { return asked_for_; }

 private:
  std::uint32_t use(const Material& material);
  std::uint32_t resolve(const MeshEntry& entry, const std::string& material,
                        const std::string& group, std::vector<std::string>& unknown);

  const SceneFile& file_;
  SceneReport& report_;
  std::vector<Material> materials_;
  std::set<std::string> asked_for_;
};

}  // namespace sarnerf
