// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "job.h"
#include "options.h"
#include "output_lock.h"
#include "recipe_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/render/framing.h"
#include "sarnerf/scene/vdb_scene.h"
#include "values.h"

namespace sarnerf::app {

namespace {

/// Voxel size as a fraction of the finer pixel spacing: images then agree with the surface engine's within some per cent.
constexpr double kVoxelInPixels = 0.5;
/// Memory that automatic voxels may take if no limit is given.
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

/// Locks the file of --save-volume before long work, and writes the voxels to it. A file that is there is replaced with --overwrite
/// alone; a repeated or continued command finds its own voxels in it.
class VolumePlace {
 public:
  explicit VolumePlace(const Options& options)
      : file_(options.dry_run ? std::filesystem::path() : options.save_volume), overwrite_(options.overwrite) {
    if (file_.empty()) return;
    if (file_.has_parent_path()) make_folder(file_.parent_path());
    lock_.emplace(std::vector{file_});
  }
  void write(const VdbScene& voxels, Console& console) const {
    if (file_.empty()) return;
    if (overwrite_ || !std::filesystem::exists(file_)) {
      write_vdb(voxels, file_);
    } else if (!holds(voxels)) {
      throw UsageError("--save-volume: " + file_.string() +
                       " exists, and holds other voxels than this command's; choose another name or allow --overwrite");
    }
    console.note("the voxels are in " + file_.string());
  }

 private:
  /// The same voxels give the same bytes.
  bool holds(const VdbScene& voxels) const {
    // Beside the file, where there is room for it; the lock keeps the name to this process.
    const std::filesystem::path again = file_.parent_path() / ("." + file_.filename().string() + ".again");
    if (std::filesystem::exists(again))
      throw UsageError("--save-volume: " + again.string() + " is in the way (an interrupted comparison may have left it); remove it");
    write_vdb(voxels, again);
    const bool same = sha256_of_file(again) == sha256_of_file(file_);
    std::filesystem::remove(again);
    return same;
  }

  std::filesystem::path file_;
  bool overwrite_;
  std::optional<OutputLock> lock_;
};

/// The voxels, and voxels of twice the size, with which views estimate the error of the voxels.
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
  VoxelLevels levels{to_volume(voxels, voxelising.max_memory_bytes, monitor), {}};
  voxelising.voxel_size_m *= 2.0;
  levels.coarse = to_volume(voxelise(scene, voxelising), voxelising.max_memory_bytes, monitor);
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
  loaded.volume = to_volume(voxels, memory_for_volume(load.max_memory_bytes), load.monitor);
  loaded.is_fog = voxels.is_fog;
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
                              : "engine surface: the scene is a mesh of homogeneous materials, for which it is faster and more accurate "
                                "than voxels; it estimates its own error (--engine)");
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

namespace {

/// Memory of the program and its libraries: that of `--version`, and a little more.
constexpr std::uint64_t kProgramBytes = 90'000'000;

/// Bytes per pixel of one copy of an image, and of its grey picture with the memory that encoding leaves behind.
constexpr std::uint64_t kImage = sizeof(float), kPicture = 2;

/// Bytes per pixel that a job holds at a time, for images, not for rays. They are 5 to 25 % above the measured peaks
/// of processes that rendered 16 to 36 million pixels, with and without layers, speckle and noise.
struct BytesPerPixel {
  std::uint64_t rendering = 0;  ///< the image, the coarser one of its error, layers
  std::uint64_t forming = 0;    ///< impulse response, speckle and noise
  std::uint64_t encoding = 0;   ///< the image, its files, and the copy that determines the white level
  std::uint64_t held = 0;       ///< of a view that waits for the scale of its sweep's pictures

  explicit BytesPerPixel(const Options& o) {
    const std::uint64_t layers = bytes_per_pixel(o.layers);
    const std::uint64_t beside = layers > 0 ? layers + kImage : 0;  // and the image that they add up to
    // --error keeps a pilot that meets the tolerance, with its image.
    const std::uint64_t pilot = o.tolerance ? kImage + kPicture : 0;
    rendering = 2 * kImage + layers + pilot;
    if (o.formation.any()) forming = kImage + formation_bytes_per_pixel(o.formation) + beside + kPicture + pilot;
    // Layers are encoded all at once, and then drawn in colours.
    encoding = 3 * kImage + kPicture + (layers > 0 ? 2 * layers + kImage + 3 * kPicture : 0) + pilot;
    held = 2 * kImage + beside;
  }
  std::uint64_t most() const { return std::max({rendering, forming, encoding}); }
};

/// A view and its plan, with the lines that explain it.
constexpr std::uint64_t kBytesPerPlan = 1300;

std::uint64_t n_pixels(const std::pair<int, int>& size) {
  return std::uint64_t(size.first) * std::uint64_t(size.second);
}

std::string size_text(const std::pair<int, int>& size) {
  return std::to_string(size.first) + " x " + std::to_string(size.second);
}

/// Most pixels of a square image whose file can be read.
constexpr double kMostPixels = double(kMostImageFileBytes / sizeof(float) - 100'000);

std::uint64_t scene_bytes(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  return mesh.vertices_m.size() * sizeof(glm::dvec3) +
         mesh.triangles.size() * (sizeof(glm::uvec3) + 3 * sizeof(std::uint32_t)) +
         scene.pieces.size() * sizeof(Piece);
}

/// Hint on the size of the loaded scene; empty if the user gave the image's size, which then does not depend on the scene's.
std::string hint(const Job& job) {
  return job.framing.empty() ? "" : "; " + scene_size_hint(*job.scene);
}

/// Throws UsageError with what would fit: an image side, or a higher limit if not even the smallest image would.
[[noreturn]] void refuse(const std::pair<int, int>& size, std::uint64_t fixed_bytes, std::uint64_t needed_bytes,
                         std::uint64_t bytes_per_pixel, const MemoryLimit& limit, const std::string& hint) {
  std::string advice;
  const double room = limit.bytes > fixed_bytes ? double(limit.bytes - fixed_bytes) / double(bytes_per_pixel) : 0.0;
  const auto side = static_cast<long>(std::floor(std::sqrt(std::min(room, kMostPixels))));
  if (side >= 16) {
    const std::string text = std::to_string(side);
    advice = "an image of up to " + text + "x" + text + " pixels would fit (--size, --spacing)";
  } else {
    advice = "scene and program alone take about " + bytes_text(fixed_bytes) + ": raise the limit";
  }
  throw UsageError("rendering " + size_text(size) + " pixels needs about " + bytes_text(needed_bytes) + ", " + limit.text() +
                   "; " + advice + hint);
}

/// Images must be readable after they are written, by these programs too.
void refuse_file(const std::pair<int, int>& size, const std::string& hint) {
  const std::uint64_t frame = 8192 + 16 * static_cast<std::uint64_t>(size.first);  // the file's header and tables of offsets
  const std::uint64_t bytes = n_pixels(size) * sizeof(float) + frame;
  if (bytes <= kMostImageFileBytes) return;
  const auto side = static_cast<long>(std::sqrt(kMostPixels));
  throw UsageError("an image of " + size_text(size) + " pixels would be a file of " + bytes_text(bytes) + ", and readers accept at most " +
                   bytes_text(kMostImageFileBytes) + ": " + std::to_string(side) + "x" + std::to_string(side) +
                   " pixels are possible (--size, --spacing)" + hint);
}

/// Memory of the views of a sweep that wait until all views for the pictures' scale are rendered.
std::uint64_t held_bytes(const Options& o, std::size_t n_views) {
  if (n_views < 2) return 0;
  return DisplayScale::sample_views(n_views).size() * BytesPerPixel(o).held * n_pixels(*o.size);
}

/// Memory at the peak of one view that `n_threads` render.
std::uint64_t view_bytes(const Job& job, const ViewPlan& plan, int n_threads) {
  const BytesPerPixel each(job.options);
  const std::uint64_t n = n_pixels({plan.acquisition.n_azimuth, plan.acquisition.n_range});
  const std::uint64_t images = (2 * kImage + bytes_per_pixel(job.options.layers)) * n;
  return plan.memory_bytes - std::min(images, plan.memory_bytes) + static_cast<std::uint64_t>(n_threads) * plan.worker_bytes +
         each.most() * n;
}

const ViewPlan& largest_plan(const Job& job) {
  return *std::max_element(job.plans.begin(), job.plans.end(), [](const ViewPlan& a, const ViewPlan& b) {
    return a.memory_bytes + a.worker_bytes < b.memory_bytes + b.worker_bytes;
  });
}

/// Throws UsageError for a view that needs most of its memory for its rays: a smaller image would not help.
[[noreturn]] void refuse_rays(const Job& job, std::uint64_t needed_bytes) {
  const auto n_threads = static_cast<std::uint64_t>(job.options.shared.n_threads);
  throw UsageError("tracing " + counted(static_cast<std::uint64_t>(largest_plan(job).fan.n_elevation), "elevation ray", "elevation rays") +
                   " on " + counted(n_threads, "thread", "threads") + " needs about " + bytes_text(needed_bytes) + ", " +
                   job.memory_limit.text() + "; give fewer --elevations" + (n_threads > 1 ? " or --threads" : "") +
                   ", or raise the limit");
}

/// Memory while the engine is built; voxels exist as grids and as bricks then.
std::uint64_t building_bytes(const Job& job) {
  const std::uint64_t engine = job.built.voxel && !job.options.volume()
                                   ? expected_voxel_memory_bytes(*job.scene, job.built.voxel_size_m) +
                                         expected_voxel_memory_bytes(*job.scene, 2.0 * job.built.voxel_size_m)
                                   : expected_engine_memory_bytes(job.scene->mesh.triangles.size());
  return kProgramBytes + scene_bytes(*job.scene) + engine;
}

}  // namespace

std::uint64_t memory_for_volume(std::uint64_t limit_bytes) {
  if (limit_bytes == 0) return 0;
  return limit_bytes > kProgramBytes ? limit_bytes - kProgramBytes : 1;
}

void refuse_size_beyond_memory(const Options& options, const MemoryLimit& limit) {
  if (!options.size) return;
  const std::uint64_t each = BytesPerPixel(options).most();
  const std::uint64_t needed = kProgramBytes + each * n_pixels(*options.size);
  if (!limit.allows(needed)) refuse(*options.size, kProgramBytes, needed, each, limit, "");
  refuse_file(*options.size, "");
}

void refuse_scene_beyond_memory(const Job& job) {
  const std::uint64_t each = BytesPerPixel(job.options).most();
  const std::uint64_t fixed = kProgramBytes + kBytesPerPlan * job.views.size() + scene_bytes(*job.scene) +
                              expected_engine_memory_bytes(job.scene->mesh.triangles.size());
  const std::uint64_t needed = fixed + each * n_pixels(*job.options.size);
  if (!job.memory_limit.allows(needed)) refuse(*job.options.size, fixed, needed, each, job.memory_limit, hint(job));
  refuse_file(*job.options.size, hint(job));
}

void decide_views_at_once(Job& job) {
  const MemoryLimit& limit = job.memory_limit;
  const std::uint64_t fixed = kProgramBytes + kBytesPerPlan * job.views.size() + scene_bytes(*job.scene) + job.built.engine->memory_bytes();
  const int n_threads = job.options.shared.n_threads;
  const std::uint64_t each = view_bytes(job, largest_plan(job), n_threads), held = held_bytes(job.options, job.views.size());
  const std::uint64_t n = n_pixels(*job.options.size);
  if (!limit.allows(fixed + held + each)) {
    const std::uint64_t for_images = BytesPerPixel(job.options).most() * n;
    if (each > 2 * for_images && held < each) refuse_rays(job, fixed + held + each);
    // Rays and rows grow with the image: their memory is counted with its pixels.
    refuse(*job.options.size, fixed, fixed + held + each, (held + each) / n + 1, limit, hint(job));
  }
  // Of views at the same time, one thread renders each.
  const std::uint64_t all = static_cast<std::uint64_t>(n_threads) * view_bytes(job, largest_plan(job), 1);
  const bool enough = job.views.size() >= 2 * static_cast<std::size_t>(n_threads);
  const bool at_once = enough && limit.allows(fixed + held + all);
  job.n_views_at_once = at_once ? n_threads : 1;
  job.memory_bytes = std::max(fixed + held + (at_once ? all : each), building_bytes(job));
}

}  // namespace sarnerf::app
