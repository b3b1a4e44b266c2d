// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "console.h"
#include "output_lock.h"
#include "random_scenes.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/text.h"
#include "values.h"

namespace sarnerf::bench {

namespace {

namespace fs = std::filesystem;

/// Numbers and ranges first:last, separated by commas, in the order given.
std::vector<std::uint64_t> parse_seeds(const std::string& text) {
  constexpr std::int64_t kMostSeed = 999'999'999;
  constexpr std::size_t kMostScenes = 10'000;
  std::vector<std::uint64_t> seeds;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    const std::size_t colon = item.find(':');
    const std::int64_t first = app::parse_whole("--seed", item.substr(0, colon), 0, kMostSeed);
    const std::int64_t last =
        colon == std::string::npos ? first : app::parse_whole("--seed", item.substr(colon + 1), 0, kMostSeed);
    if (last < first) throw UsageError("--seed: expected a range first:last such as 101:109, found '" + item + "'");
    if (seeds.size() + static_cast<std::size_t>(last - first) >= kMostScenes)
      throw UsageError("--seed: expected at most " + with_thousands(kMostScenes) + " scenes, found more in '" + text + "'");
    for (std::int64_t seed = first; seed <= last; ++seed) seeds.push_back(static_cast<std::uint64_t>(seed));
    begin = end + 1;
  }
  return seeds;
}

/// The paths and texts of a scene's files.
struct SceneFiles {
  std::array<std::pair<fs::path, std::string>, 2> texts;  ///< the mesh, then the scene file that names it

  SceneFiles(const RandomScene& scene, const fs::path& output)
      : texts{{{output / scene.name / "scene.obj", obj_text(scene)},
               {output / scene.name / "scene.json", scene_json_text(scene)}}} {}

  const fs::path& scene_file() const { return texts[1].first; }
};

bool is_there(const fs::path& path, const std::string& text) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && read_whole_file(path) == text;
}

void require_place(const SceneFiles& files) {
  std::error_code ignored;
  for (const auto& [path, text] : files.texts) {
    if (fs::exists(path, ignored) && !is_there(path, text))
      throw UsageError(path.string() + ": another scene is in the way; choose another folder (-o) or allow --overwrite");
  }
}

/// Writes the missing files. Returns whether any was missing.
bool write(const SceneFiles& files) {
  AtomicFiles missing;
  bool any = false;
  make_folder(files.scene_file().parent_path());
  for (const auto& [path, text] : files.texts) {
    if (is_there(path, text)) continue;
    missing.add(path, text);
    any = true;
  }
  missing.commit();
  return any;
}

/// "101_solid: 3 pieces, 412 triangles, 9.8 x 7.2 m, 4.1 m high".
std::string description(const RandomScene& scene) {
  Box bounds;
  std::size_t n_triangles = 0;
  for (const ScenePiece& piece : scene.pieces) {
    n_triangles += piece.triangles.size();
    for (const glm::dvec3& p : piece.vertices_m) bounds.include(p);
  }
  const glm::dvec3 size = bounds.size();
  return scene.name + ": " + counted(scene.pieces.size(), "piece") + ", " + counted(n_triangles, "triangle") +
         format(", %.1f x %.1f m, %.1f m high", size.x, size.z, size.y);
}

}  // namespace

void run_scenes_command(const ScenesOptions& o, app::Console& console) {
  const std::vector<std::uint64_t> seeds = parse_seeds(o.seeds);
  std::error_code ignored;
  if (fs::exists(o.output, ignored) && !fs::is_directory(o.output, ignored))
    throw UsageError(o.output.string() + ": expected a place for a folder, found a file; choose another folder (-o)");
  if (o.quiet) console.set_verbosity(-1);
  // Scenes are generated again when they are written, since thousands of them together take gigabytes.
  const auto require_places = [&] {
    if (o.overwrite) return;
    for (const std::uint64_t seed : seeds) require_place(SceneFiles(random_scene(seed), o.output));
  };
  if (o.dry_run) {
    require_places();
    std::string plan = "plan\n";
    for (const std::uint64_t seed : seeds) {
      const RandomScene scene = random_scene(seed);
      plan += "  scene      " + description(scene) + "\n";
      plan += "  output     " + SceneFiles(scene, o.output).scene_file().string() + "\n";
    }
    app::print_result(plan);
    return;
  }
  make_folder(o.output);
  const app::FolderLock lock(o.output);
  require_places();
  for (const std::uint64_t seed : seeds) {
    const RandomScene scene = random_scene(seed);
    const SceneFiles files(scene, o.output);
    console.note(description(scene) + (write(files) ? "" : "; was there"));
    app::print_result(files.scene_file().string() + "\n");
  }
}

}  // namespace sarnerf::bench
