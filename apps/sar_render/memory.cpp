// SPDX-License-Identifier: Apache-2.0
#include "memory.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "job.h"
#include "sarnerf/core/error.h"
#include "sarnerf/render/surface_engine.h"
#include "sarnerf/scene/voxelise.h"
#include "values.h"

namespace sarnerf::app {
namespace {

/// The program, its libraries and small change: what `--version` takes, and a little.
constexpr std::uint64_t kProgramBytes = 90'000'000;

/// Per pixel while an image becomes files: encoded twice over, its grey levels, and the copy from which
/// the percentile is taken. The image itself is in the plan.
constexpr std::uint64_t kProductBytesPerPixel = 14;
constexpr std::uint64_t kImageBytesPerPixel = 4;
/// Of each layer while it becomes files: encoded, as colours, and these encoded.
constexpr std::uint64_t kLayerCopies = 3;

std::uint64_t n_pixels(const std::pair<int, int>& size) {
  return std::uint64_t(size.first) * std::uint64_t(size.second);
}

std::uint64_t image_bytes(const std::pair<int, int>& size) {
  return n_pixels(size) * (kImageBytesPerPixel + kProductBytesPerPixel);
}

std::uint64_t scene_bytes(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  return mesh.vertices_m.size() * sizeof(glm::dvec3) +
         mesh.triangles.size() * (sizeof(glm::uvec3) + 3 * sizeof(std::uint32_t)) +
         scene.pieces.size() * sizeof(Piece);
}

/// What would fit: an image side, or a limit when not even the smallest image would.
[[noreturn]] void refuse(std::uint64_t fixed_bytes, std::uint64_t needed_bytes,
                         std::uint64_t bytes_per_pixel, std::uint64_t limit_bytes) {
  std::string advice;
  const double room = limit_bytes > fixed_bytes
                          ? double(limit_bytes - fixed_bytes) / double(bytes_per_pixel)
                          : 0.0;
  const auto side = static_cast<long>(std::min(65535.0, std::floor(std::sqrt(room))));
  if (side >= 16) {
    const std::string text = std::to_string(side);
    advice = "an image of up to " + text + "x" + text + " pixels would fit (--size, --spacing)";
  } else {
    advice = "scene and program alone take about " + bytes_text(fixed_bytes) + ": raise the limit";
  }
  throw UsageError("rendering needs about " + bytes_text(needed_bytes) + ", --max-memory allows " +
                   bytes_text(limit_bytes) + "; " + advice);
}

/// Of images and what becomes of them, whatever the rays.
std::uint64_t product_bytes(const Job& job) {
  const std::uint64_t layer_bytes = kLayerCopies * bytes_per_pixel(job.options.layers);
  return n_pixels(*job.options.size) * (kProductBytesPerPixel + layer_bytes);
}

const ViewPlan& largest_plan(const Job& job) {
  return *std::max_element(job.plans.begin(), job.plans.end(), [](const ViewPlan& a, const ViewPlan& b) {
    return a.memory_bytes < b.memory_bytes;
  });
}

/// Most of what a view needs is for its rays: a smaller image would not help.
[[noreturn]] void refuse_rays(const Job& job, std::uint64_t needed_bytes, std::uint64_t limit_bytes) {
  throw UsageError("tracing " + std::to_string(largest_plan(job).fan.n_elevation) +
                   " elevation rays on " + std::to_string(job.options.shared.n_threads) +
                   " threads needs about " + bytes_text(needed_bytes) + ", --max-memory allows " +
                   bytes_text(limit_bytes) + "; give fewer --elevations or --threads, or raise the limit");
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

std::uint64_t memory_for_voxelising(std::uint64_t limit_bytes) {
  if (limit_bytes > 0) return memory_for_volume(limit_bytes);
  const long n_pages = ::sysconf(_SC_PHYS_PAGES), page_bytes = ::sysconf(_SC_PAGE_SIZE);
  if (n_pages <= 0 || page_bytes <= 0) return 0;
  return memory_for_volume(static_cast<std::uint64_t>(n_pages) * static_cast<std::uint64_t>(page_bytes));
}

void refuse_size_beyond_memory(const Options& options) {
  const std::uint64_t limit = options.shared.max_memory_bytes;
  if (limit == 0 || !options.size) return;
  const std::uint64_t needed = kProgramBytes + image_bytes(*options.size);
  if (needed > limit) {
    refuse(kProgramBytes, needed, kImageBytesPerPixel + kProductBytesPerPixel, limit);
  }
}

void refuse_scene_beyond_memory(const Job& job) {
  const std::uint64_t limit = job.options.shared.max_memory_bytes;
  if (limit == 0) return;
  const std::uint64_t fixed = kProgramBytes + scene_bytes(*job.scene) +
                              expected_engine_memory_bytes(job.scene->mesh.triangles.size());
  const std::uint64_t needed = fixed + image_bytes(*job.options.size);
  if (needed > limit) {
    refuse(fixed, needed, kImageBytesPerPixel + kProductBytesPerPixel, limit);
  }
}

void decide_views_at_once(Job& job) {
  const std::uint64_t limit = job.options.shared.max_memory_bytes;
  const std::uint64_t fixed = kProgramBytes + scene_bytes(*job.scene) + job.built.engine->memory_bytes();
  const std::uint64_t plan_bytes = largest_plan(job).memory_bytes;
  const std::uint64_t each = plan_bytes + product_bytes(job);
  if (limit != 0 && fixed + each > limit) {
    if (plan_bytes > each / 2 && plan_bytes > 8 * n_pixels(*job.options.size) * kImageBytesPerPixel) {
      refuse_rays(job, fixed + each, limit);
    }
    // Rays and rows grow with the image: count them with its pixels.
    refuse(fixed, fixed + each, each / n_pixels(*job.options.size) + 1, limit);
  }
  const int n_threads = job.options.shared.n_threads;
  const bool enough = job.views.size() >= 2 * static_cast<std::size_t>(n_threads);
  const bool fits = limit == 0 || fixed + each * static_cast<std::uint64_t>(n_threads) <= limit;
  job.n_views_at_once = enough && fits ? n_threads : 1;
  const std::uint64_t built = fixed + each * static_cast<std::uint64_t>(job.n_views_at_once);
  job.memory_bytes = std::max(built, building_bytes(job));
}

}  // namespace sarnerf::app
