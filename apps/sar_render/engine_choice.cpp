// SPDX-License-Identifier: Apache-2.0
#include "engine_choice.h"

#include <algorithm>
#include <cstdio>

#include "memory.h"
#include "output_lock.h"
#include "output_place.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/stopwatch.h"
#include "sarnerf/render/surface_engine.h"
#include "sarnerf/render/voxel_engine.h"
#include "sarnerf/scene/vdb_scene.h"
#include "sarnerf/scene/voxelise.h"
#include "values.h"

namespace sarnerf::app {
namespace {

/// Voxels this fraction of the finer pixel side: within some per cent of the surface engine's images.
constexpr double kVoxelInPixels = 0.5;
/// Memory that automatic voxels may take where no limit is given.
constexpr std::uint64_t kDefaultBudgetBytes = 4'000'000'000;

std::string metres(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g m", value);
  return text;
}

double choose_voxel_size_m(const Options& options, const Scene& scene, std::vector<std::string>& notes) {
  if (options.voxel_size_m) return *options.voxel_size_m;
  const double finer_m = std::min(options.spacing_m.first, options.spacing_m.second);
  const std::uint64_t limit = memory_for_volume(options.shared.max_memory_bytes);
  const std::uint64_t budget = limit > 0 ? limit / 2 : kDefaultBudgetBytes;
  double size_m = kVoxelInPixels * finer_m;
  if (expected_voxel_memory_bytes(scene, size_m) <= budget) {
    notes.push_back("voxels of " + metres(size_m) + ", half the finer spacing (--voxel-size)");
    return size_m;
  }
  while (expected_voxel_memory_bytes(scene, size_m) > budget) size_m *= 1.25;
  notes.push_back("voxels of " + metres(size_m) + ", as small as " + bytes_text(budget) +
                  " of memory allow; half the finer spacing would be " +
                  metres(kVoxelInPixels * finer_m) + " (--voxel-size, --max-memory)");
  return size_m;
}

/// Keeps the place of --save-volume until the voxels are there, from before long work.
class VolumePlace {
 public:
  explicit VolumePlace(const Options& options) : file_(options.dry_run ? std::filesystem::path() : options.save_volume) {
    if (file_.empty()) return;
    if (file_.has_parent_path()) make_folder(file_.parent_path());
    lock_.emplace(std::vector{file_});
    require_volume_place(options);
  }
  void write(const VdbScene& voxels, Console& console) const {
    if (file_.empty()) return;
    write_vdb(voxels, file_);
    console.note("the voxels are in " + file_.string());
  }

 private:
  std::filesystem::path file_;
  std::optional<OutputLock> lock_;
};

/// The voxels, and others of twice the size, from which views estimate what voxels cost in accuracy.
struct VoxelLevels {
  Volume fine, coarse;
};

VoxelLevels voxels_of(const Options& options, const Scene& scene, const MemoryLimit& limit, BuiltEngine& built,
                      Console& console, const Monitor& monitor) {
  const Stopwatch watch;
  const VolumePlace place(options);
  VoxeliseOptions voxelising;
  voxelising.voxel_size_m = choose_voxel_size_m(options, scene, built.notes);
  voxelising.max_memory_bytes = memory_for_volume(limit.bytes);
  voxelising.monitor = monitor;
  const VdbScene voxels = voxelise(scene, voxelising);
  place.write(voxels, console);
  VoxelLevels levels{to_volume(voxels, voxelising.max_memory_bytes), {}};
  voxelising.voxel_size_m *= 2.0;
  levels.coarse = to_volume(voxelise(scene, voxelising), voxelising.max_memory_bytes);
  built.voxelise_s = watch.seconds();
  return levels;
}

}  // namespace

LoadedVolume load_volume(const Options& options, const LoadOptions& load, Console& console) {
  const VolumePlace place(options);
  VdbReadOptions reading;
  reading.up = load.up;
  reading.units_m = load.units_m;
  reading.scale = load.scale;
  reading.extinction_per_density = options.extinction_per_density;
  reading.max_memory_bytes = memory_for_volume(load.max_memory_bytes);
  reading.monitor = load.monitor;
  const VdbScene voxels = read_vdb(options.scene, reading);
  for (const std::string& note : voxels.notes) console.note(note);
  place.write(voxels, console);
  LoadedVolume loaded;
  loaded.volume = to_volume(voxels, memory_for_volume(load.max_memory_bytes));
  loaded.scene = scene_around(loaded.volume, options.scene, load);
  return loaded;
}

BuiltEngine build_engine(const Options& options, const Scene& scene, std::optional<Volume> volume,
                         const MemoryLimit& limit, Console& console, const Monitor& monitor) {
  BuiltEngine built;
  const bool keeps_voxels = options.voxel_size_m || !options.save_volume.empty();
  built.voxel = volume || options.engine == EngineChoice::voxel ||
                (options.engine == EngineChoice::automatic && keeps_voxels);
  if (options.engine == EngineChoice::automatic) {
    built.notes.push_back(volume ? "engine voxel: the scene is a volume"
                          : built.voxel
                              ? "engine voxel: voxels were asked for"
                              : "engine surface: the scene is a mesh of homogeneous matter, whose faces it "
                                "joins from few hits and deposits in closed form: nearer to the truth than voxels, and faster; "
                                "what it misses between rays it estimates (--engine)");
  }
  if (!built.voxel) {
    built.engine = std::make_unique<const SurfaceEngine>(scene);
    return built;
  }
  std::optional<Volume> coarse;
  if (!volume) {
    VoxelLevels levels = voxels_of(options, scene, limit, built, console, monitor);
    volume = std::move(levels.fine);
    coarse = std::move(levels.coarse);
  }
  built.n_voxels = volume->n_occupied_voxels;
  built.voxel_size_m = volume->grid.transform().voxel_size_m;
  built.engine = std::make_unique<const VoxelEngine>(scene, std::move(*volume), std::move(coarse));
  return built;
}

}  // namespace sarnerf::app
