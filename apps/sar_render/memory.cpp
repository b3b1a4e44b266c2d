// SPDX-License-Identifier: Apache-2.0
#include "memory.h"

#include <algorithm>
#include <cmath>

#include "display_scale.h"
#include "job.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/render/framing.h"
#include "sarnerf/render/surface_engine.h"
#include "sarnerf/scene/voxelise.h"
#include "values.h"

namespace sarnerf::app {
namespace {

/// The program, its libraries and small change: what `--version` takes, and a little.
constexpr std::uint64_t kProgramBytes = 90'000'000;

/// Bytes per pixel of an image that is there once, and of its picture in grey, with what encoding that leaves behind.
constexpr std::uint64_t kImage = sizeof(float), kPicture = 2;

/// What a job keeps of each pixel at a time; of its images, not its rays. Measured within 5 to 25 % above the peaks of
/// processes that rendered 16 to 36 million pixels, with and without layers, speckle and noise.
struct BytesPerPixel {
  std::uint64_t rendering = 0;  ///< the image, the coarser one of its error, layers
  std::uint64_t forming = 0;    ///< impulse response, speckle and noise
  std::uint64_t encoding = 0;   ///< the image, its files, and the copy from which white is taken
  std::uint64_t held = 0;       ///< of a view that waits for the scale of its sweep's pictures

  explicit BytesPerPixel(const Options& o) {
    const std::uint64_t layers = bytes_per_pixel(o.layers);
    const std::uint64_t beside = layers > 0 ? layers + kImage : 0;  // and the image that they add up to
    // --error keeps the pilot that may have been good enough, with its image.
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

/// Of a square image whose file can be read.
constexpr double kMostPixels = double(kMostImageFileBytes / sizeof(float) - 100'000);

std::uint64_t scene_bytes(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  return mesh.vertices_m.size() * sizeof(glm::dvec3) +
         mesh.triangles.size() * (sizeof(glm::uvec3) + 3 * sizeof(std::uint32_t)) +
         scene.pieces.size() * sizeof(Piece);
}

/// The scene is not known before it is loaded, and its size is no matter where the user gave the image's.
std::string hint(const Job& job) {
  return job.framing.empty() ? "" : "; " + scene_size_hint(*job.scene);
}

/// What would fit: an image side, or a limit when not even the smallest image would.
[[noreturn]] void refuse(const std::pair<int, int>& size, std::uint64_t fixed_bytes, std::uint64_t needed_bytes, std::uint64_t bytes_per_pixel,
                         const MemoryLimit& limit, const std::string& hint) {
  std::string advice;
  const double room = limit.bytes > fixed_bytes ? double(limit.bytes - fixed_bytes) / double(bytes_per_pixel) : 0.0;
  const auto side = static_cast<long>(std::floor(std::sqrt(std::min(room, kMostPixels))));
  if (side >= 16) {
    const std::string text = std::to_string(side);
    advice = "an image of up to " + text + "x" + text + " pixels would fit (--size, --spacing)";
  } else {
    advice = "scene and program alone take about " + bytes_text(fixed_bytes) + ": raise the limit";
  }
  throw UsageError("rendering " + size_text(size) + " pixels needs about " + bytes_text(needed_bytes) + ", " + limit.text() + "; " + advice + hint);
}

/// What is written must be readable, by these programs too.
void refuse_file(const std::pair<int, int>& size, const std::string& hint) {
  const std::uint64_t frame = 8192 + 16 * static_cast<std::uint64_t>(size.first);  // where the file says what lies where
  const std::uint64_t bytes = n_pixels(size) * sizeof(float) + frame;
  if (bytes <= kMostImageFileBytes) return;
  const auto side = static_cast<long>(std::sqrt(kMostPixels));
  throw UsageError("an image of " + size_text(size) + " pixels would be a file of " + bytes_text(bytes) + ", and readers end at " +
                   bytes_text(kMostImageFileBytes) + ": " + std::to_string(side) + "x" + std::to_string(side) +
                   " pixels are possible (--size, --spacing)" + hint);
}

/// Views of a sweep that wait until all that the pictures' scale is taken from are rendered.
std::uint64_t held_bytes(const Options& o, std::size_t n_views) {
  if (n_views < 2) return 0;
  return DisplayScale::sample_views(n_views).size() * BytesPerPixel(o).held * n_pixels(*o.size);
}

/// At the peak of one view.
std::uint64_t view_bytes(const Job& job, const ViewPlan& plan) {
  const BytesPerPixel each(job.options);
  const std::uint64_t n = n_pixels({plan.acquisition.n_azimuth, plan.acquisition.n_range});
  const std::uint64_t images = (2 * kImage + bytes_per_pixel(job.options.layers)) * n;
  return plan.memory_bytes - std::min(images, plan.memory_bytes) + each.most() * n;
}

const ViewPlan& largest_plan(const Job& job) {
  return *std::max_element(job.plans.begin(), job.plans.end(), [](const ViewPlan& a, const ViewPlan& b) {
    return a.memory_bytes < b.memory_bytes;
  });
}

/// Most of what a view needs is for its rays: a smaller image would not help.
[[noreturn]] void refuse_rays(const Job& job, std::uint64_t needed_bytes) {
  const auto n_threads = static_cast<std::uint64_t>(job.options.shared.n_threads);
  throw UsageError("tracing " + counted(static_cast<std::uint64_t>(largest_plan(job).fan.n_elevation), "elevation ray", "elevation rays") +
                   " on " + counted(n_threads, "thread", "threads") + " needs about " + bytes_text(needed_bytes) + ", " +
                   job.memory_limit.text() + "; give fewer --elevations" + (n_threads > 1 ? " or --threads" : "") +
                   ", or raise the limit");
}

/// While the engine is built; voxels exist as grids and as bricks then.
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
  const std::uint64_t each = view_bytes(job, largest_plan(job)), held = held_bytes(job.options, job.views.size());
  const std::uint64_t n = n_pixels(*job.options.size);
  if (!limit.allows(fixed + held + each)) {
    const std::uint64_t for_images = BytesPerPixel(job.options).most() * n;
    if (each > 2 * for_images && held < each) refuse_rays(job, fixed + held + each);
    // Rays and rows grow with the image: count them with its pixels.
    refuse(*job.options.size, fixed, fixed + held + each, (held + each) / n + 1, limit, hint(job));
  }
  const int n_threads = job.options.shared.n_threads;
  const bool enough = job.views.size() >= 2 * static_cast<std::size_t>(n_threads);
  const bool fits = limit.allows(fixed + held + each * static_cast<std::uint64_t>(n_threads));
  job.n_views_at_once = enough && fits ? n_threads : 1;
  const std::uint64_t built = fixed + held + each * static_cast<std::uint64_t>(job.n_views_at_once);
  job.memory_bytes = std::max(built, building_bytes(job));
}

}  // namespace sarnerf::app
