// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "readers/readers.h"
#include "readers/scene_file.h"
#include "repair/repair.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/scene/scene.h"
#include "triangle_soup.h"

namespace sarnerf {

namespace {

/// Assigns a material of the library to each face, and collects those in use. Materials that the user names
/// must exist; names that come with a mesh are looked up, and unknown ones become "default".
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
  // Few different pairs of material and group occur, in long runs.
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
  // Numeric names from PLY files are quoted; otherwise they would read as counts.
  const auto quoted = [](const std::string& name) {
    return name.find_first_not_of("0123456789") == std::string::npos ? in_quotes(name) : name;
  };
  std::sort(unknown.begin(), unknown.end());
  unknown.erase(std::unique(unknown.begin(), unknown.end()), unknown.end());
  std::transform(unknown.begin(), unknown.end(), unknown.begin(), quoted);
  const std::string what = counted(unknown.size(), "material", "materials") + " of " + file +
                           (file_.materials_source.empty()
                                ? " not among the built-in ones, rendered with the material 'default': "
                                : " not in " + file_.materials_source + ", rendered with the material 'default': ") +
                           listed(unknown, 10);
  // A user who gave materials probably meant to name them all: a warning instead of a note.
  (file_.materials_source.empty() ? report_.notes : report_.warnings).push_back(what);
}

bool is_scene_file(const std::filesystem::path& path) {
  return path.extension() == ".json" || path.extension() == ".JSON";
}

/// A single mesh file is a scene of one entry, described by the options.
SceneFile describe(const std::filesystem::path& path, const LoadOptions& options) {
  SceneFile file;
  if (is_scene_file(path)) {
    if (options.up != UpAxis::y || options.units_m != 1.0 || options.scale != 1.0) {
      throw UsageError(path.string() +
                       ": --up, --units and --scale describe a mesh file; in a scene file "
                       "write \"up\", \"units\" and \"scale\" beside each mesh");
    }
    file = read_scene_file(path);
  } else {
    MeshEntry entry;
    entry.file = path;
    entry.place = path.string();
    entry.up = options.up;
    entry.metres_per_unit = options.units_m * options.scale;
    file.meshes.push_back(std::move(entry));
  }
  if (!options.materials_file.empty()) {
    file.given_materials = file.library.add_file(options.materials_file);
    file.materials_source = options.materials_file.string();
  }
  if (options.ground_material == "none") {
    file.ground.reset();
  } else if (options.ground_material) {
    file.library.require_ground(*options.ground_material);
    file.ground = GroundEntry{*options.ground_material,
                              file.ground ? file.ground->height_m : std::nullopt, "--ground"};
  }
  if (file.ground && options.ground_height_m) file.ground->height_m = options.ground_height_m;
  return file;
}

/// All files that were read, each once.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& path,
                                            const SceneFile& file, const LoadOptions& options) {
  std::vector<std::filesystem::path> files{path};
  const auto add = [&](const std::filesystem::path& more) {
    if (!more.empty() && std::find(files.begin(), files.end(), more) == files.end()) {
      files.push_back(more);
    }
  };
  for (const MeshEntry& entry : file.meshes) add(entry.file);
  add(file.materials_file);
  add(options.materials_file);
  return files;
}

void require_meaning(const LoadOptions& options) {
  for (const auto& [value, name] :
       {std::pair(options.units_m, "--units"), std::pair(options.scale, "--scale")}) {
    if (!(value > 0.0) || !std::isfinite(value)) {
      throw UsageError(std::string(name) + ": expected a number above 0, found " +
                       number_text(value));
    }
  }
  if (options.ground_height_m && !std::isfinite(*options.ground_height_m)) {
    throw UsageError("--ground-height: expected a finite number, found " +
                     number_text(*options.ground_height_m));
  }
}

/// Appends the meshes of a scene one by one.
class Assembly {
 public:
  Assembly(const SceneFile& file, const LoadOptions& options)
      : file_(file), options_(options), binding_(file, scene_.report) {}

  void add(const MeshEntry& entry) {
    options_.monitor.check();
    const std::string name = entry.file.filename().string();
    const std::string prefix = file_.meshes.size() > 1 ? name + ": " : "";
    TriangleSoup soup = read(entry, prefix);

    const Stopwatch watch;
    binding_.bind(entry, soup);
    const NameTable groups = soup.groups;
    RepairCounts counts;
    RepairedMesh mesh = repair_mesh(
        std::move(soup),
        {media(), options_.repair, entry.file.string(), budget(), options_.monitor}, counts);
    for (std::string& note : repair_notes(counts, prefix)) {
      scene_.report.notes.push_back(std::move(note));
    }
    if (mesh.triangles.empty()) {
      throw InputError(entry.file.string() +
                       ": expected triangles with area, found none; export it again");
    }
    warn_about_open_media(entry, mesh);
    append(entry, std::move(mesh), groups);
    scene_.report.repair_s += watch.seconds();
  }

  Scene finish() {
    if (file_.ground) {
      const GroundEntry& ground = *file_.ground;
      scene_.ground = Ground{binding_.require(ground.material, ground.place),
                             ground.height_m.value_or(scene_.box.empty() ? 0.0 : scene_.box.min.y)};
      if (!binding_.materials()[scene_.ground->material].opaque) {
        throw InputError(ground.place + ": the material " + in_quotes(ground.material) +
                         " is translucent; the ground needs an opaque one");
      }
    }
    warn_about_unused_materials();
    scene_.groups = groups_.names();
    scene_.materials = binding_.materials();
    warn_about_size(scene_);
    return std::move(scene_);
  }

 private:
  /// Warns if the scene uses none of the given materials: the file was meant for another mesh, or its names are
  /// wrong.
  void warn_about_unused_materials() {
    if (file_.given_materials.empty()) return;
    const std::vector<Material>& used = binding_.materials();
    const bool any = std::any_of(used.begin(), used.end(), [&](const Material& material) {
      return std::find(file_.given_materials.begin(), file_.given_materials.end(), material.name) !=
             file_.given_materials.end();
    });
    if (any) return;
    const auto& asked = binding_.asked_for();
    const std::vector<std::string> names(asked.begin(), asked.end());
    scene_.report.warnings.push_back(
        file_.materials_source + ": none of its materials (" + listed(file_.given_materials, 10) +
        ") is used by the scene, which " +
        (names.empty() ? "names no materials: define one called 'default'" : "asks for: " + listed(names, 10)));
  }

  /// Memory left for the next mesh.
  MemoryBudget budget() const {
    MemoryBudget budget(options_.max_memory_bytes);
    budget.add_kept(
        MemoryBudget::mesh_bytes(scene_.mesh.vertices_m.size(), scene_.mesh.triangles.size()));
    return budget;
  }

  TriangleSoup read(const MeshEntry& entry, const std::string& prefix) {
    const Stopwatch watch;
    MemoryBudget memory = budget();
    const std::string bytes = read_file(entry.file, memory);
    memory.add_kept(bytes.size());
    TriangleSoup soup =
        read_mesh(entry.file, MeshSource{bytes, entry.file.string(), memory, options_.monitor});
    scene_.report.read_s += watch.seconds();

    if (soup.n_ignored_faces > 0) {
      scene_.report.notes.push_back(prefix + "passed over " +
                                    counted(soup.n_ignored_faces, "face", "faces") +
                                    " of fewer than three corners");
    }
    if (soup.n_tangled_faces > 0) {
      scene_.report.warnings.push_back(
          prefix + counted(soup.n_tangled_faces, "polygon crosses its", "polygons cross their") +
          " own outline and may be triangulated incorrectly; triangulate the mesh where it was "
          "made");
    }
    require_reach(entry, soup);
    warn_about_precision(entry, soup, scene_.report);
    return soup;
  }

  /// 0 for opaque materials, another number for each translucent one.
  std::vector<std::uint32_t> media() const {
    std::vector<std::uint32_t> media;
    for (std::uint32_t m = 0; m < binding_.materials().size(); ++m) {
      media.push_back(binding_.materials()[m].opaque ? 0 : m + 1);
    }
    return media;
  }

  void warn_about_open_media(const MeshEntry& entry, const RepairedMesh& mesh) {
    std::vector<std::uint64_t> n_open(binding_.materials().size(), 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (!mesh.closed[mesh.piece[t]]) ++n_open[mesh.material[t]];
    }
    for (std::size_t m = 0; m < n_open.size(); ++m) {
      const Material& material = binding_.materials()[m];
      if (material.opaque || n_open[m] == 0) continue;
      scene_.report.warnings.push_back(
          entry.file.filename().string() + ": " + counted(n_open[m], "face", "faces") +
          " of the translucent material " + in_quotes(material.name) +
          " bound no volume and stay invisible; close them, or choose an opaque material");
    }
  }

  void append(const MeshEntry& entry, RepairedMesh mesh, const NameTable& groups) {
    const auto first_vertex = static_cast<std::uint32_t>(scene_.mesh.vertices_m.size());
    const auto first_piece = static_cast<std::uint32_t>(scene_.pieces.size());
    const auto object = static_cast<std::uint32_t>(scene_.objects.size());
    if (scene_.mesh.vertices_m.size() + mesh.vertices.size() >
        std::numeric_limits<std::uint32_t>::max()) {
      throw InputError(entry.place + ": the meshes together have more than 4,294,967,295 vertices");
    }
    scene_.objects.push_back(
        {entry.file.filename().string(), rigid_inverse(entry.world_from_object)});
    for (const bool closed : mesh.closed) scene_.pieces.push_back({closed, object});

    const glm::dmat3 axes(world_from_axes(entry.up));
    for (glm::dvec3& v : mesh.vertices) {
      const glm::dvec3 object_m = axes * (v * entry.metres_per_unit);
      v = glm::dvec3(entry.world_from_object * glm::dvec4(object_m, 1.0));
    }
    for (glm::uvec3& t : mesh.triangles) {
      for (int c = 0; c < 3; ++c) scene_.box.include(mesh.vertices[t[c]]);
      t += first_vertex;
    }
    constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> group_of(groups.names().size(), kUnused);
    for (std::uint32_t& g : mesh.group) {
      if (group_of[g] == kUnused) group_of[g] = groups_.index(groups[g]);
      g = group_of[g];
    }
    for (std::uint32_t& p : mesh.piece) p += first_piece;

    const auto extend = [](auto& all, auto& more) {
      if (all.empty()) {
        all = std::move(more);
      } else {
        std::copy(more.begin(), more.end(), std::back_inserter(all));
      }
    };
    extend(scene_.mesh.vertices_m, mesh.vertices);
    extend(scene_.mesh.triangles, mesh.triangles);
    extend(scene_.mesh.material, mesh.material);
    extend(scene_.mesh.piece, mesh.piece);
    extend(scene_.mesh.group, mesh.group);
  }

  static glm::dmat4 rigid_inverse(const glm::dmat4& placement) {
    const glm::dmat3 turned_back = glm::transpose(glm::dmat3(placement));
    glm::dmat4 inverse(turned_back);
    inverse[3] = glm::dvec4(-(turned_back * glm::dvec3(placement[3])), 1.0);
    return inverse;
  }

  const SceneFile& file_;
  const LoadOptions& options_;
  Scene scene_;
  MaterialBinding binding_;
  NameTable groups_;
};

}  // namespace

void require_scene_file(const std::filesystem::path& path) {
  (void)regular_file_size(path);
  if (is_scene_file(path) || is_mesh_file(path) || path.extension() == ".vdb") return;
  throw InputError(path.string() +
                   ": expected a file ending in .obj, .ply, .stl, .off, .json or .vdb, found " +
                   in_quotes(path.extension().string()) + "; convert the mesh or rename the file");
}

Scene load_scene(const std::filesystem::path& path, const LoadOptions& options) {
  require_meaning(options);
  const SceneFile file = describe(path, options);
  if (file.meshes.empty() && !file.ground) {
    throw InputError(path.string() +
                     ": expected a mesh or a ground, found neither; add one to \"meshes\"");
  }
  Assembly assembly(file, options);
  for (const MeshEntry& entry : file.meshes) assembly.add(entry);
  Scene scene = assembly.finish();
  scene.report.files = files_of(path, file, options);
  return scene;
}

}  // namespace sarnerf
