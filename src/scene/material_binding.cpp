// SPDX-License-Identifier: Apache-2.0
#include "material_binding.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "text.h"

namespace sarnerf {

std::uint32_t MaterialBinding::use(const Material& material) {
  const auto same = std::find_if(materials_.begin(), materials_.end(),
                                 [&](const Material& m) { return m.name == material.name; });
  const auto index = static_cast<std::uint32_t>(same - materials_.begin());
  if (same == materials_.end()) materials_.push_back(material);
  return index;
}

std::uint32_t MaterialBinding::require(const std::string& name, const std::string& place) {
  asked_for_.insert(name);
  return use(file_.library.require(name, place));
}

std::uint32_t MaterialBinding::resolve(const MeshEntry& entry, const std::string& material,
                                       const std::string& group,
                                       std::vector<std::string>& unknown) {
  for (const std::string& name : {material, group}) {
    const auto named = entry.materials.find(name);
    if (named != entry.materials.end()) {
      return require(named->second, entry.place + ".materials." + name);
    }
  }
  if (entry.material) return require(*entry.material, entry.place + ".material");
  if (!material.empty()) asked_for_.insert(material);
  if (const Material* found = file_.library.find(material)) return use(*found);
  if (!material.empty()) unknown.push_back(material);
  return use(file_.library.require("default", entry.place));
}

void MaterialBinding::bind(const MeshEntry& entry, TriangleSoup& soup) {
  // Few pairs of material and group occur, in long runs.
  std::unordered_map<std::uint64_t, std::uint32_t> resolved;
  std::vector<std::string> unknown;
  std::set<std::string> names_in_mesh;
  std::uint64_t last_pair = std::numeric_limits<std::uint64_t>::max();
  std::uint32_t material = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const std::uint64_t pair = std::uint64_t{soup.material[t]} << 32 | soup.group[t];
    if (pair != last_pair) {
      last_pair = pair;
      const auto known = resolved.find(pair);
      if (known != resolved.end()) {
        material = known->second;
      } else {
        const std::string& material_name = soup.materials[soup.material[t]];
        const std::string& group_name = soup.groups[soup.group[t]];
        material = resolve(entry, material_name, group_name, unknown);
        resolved.emplace(pair, material);
        names_in_mesh.insert(material_name);
        names_in_mesh.insert(group_name);
      }
    }
    soup.material[t] = material;
  }

  const std::string file = entry.file.filename().string();
  for (const auto& [name, target] : entry.materials) {
    if (names_in_mesh.count(name) > 0) continue;
    names_in_mesh.erase("");
    const std::vector<std::string> present(names_in_mesh.begin(), names_in_mesh.end());
    report_.warnings.push_back(
        entry.place + ".materials: no face of the mesh has the material or group " +
        in_quotes(name) +
        (present.empty() ? "; the mesh names none" : "; it has: " + listed(present, 10)));
  }
  if (unknown.empty()) return;
  // Numbers of PLY files would read as counts.
  const auto quoted = [](const std::string& name) {
    return name.find_first_not_of("0123456789") == std::string::npos ? in_quotes(name) : name;
  };
  std::sort(unknown.begin(), unknown.end());
  unknown.erase(std::unique(unknown.begin(), unknown.end()), unknown.end());
  std::transform(unknown.begin(), unknown.end(), unknown.begin(), quoted);
  const std::string what = counted(unknown.size(), "material", "materials") + " of " + file +
                           (file_.materials_source.empty()
                                ? " not among the built-in ones, shown as 'default': "
                                : " not in " + file_.materials_source + ", shown as 'default': ") +
                           listed(unknown, 10);
  // Who gave materials meant to name them all.
  (file_.materials_source.empty() ? report_.notes : report_.warnings).push_back(what);
}

}  // namespace sarnerf
