// SPDX-License-Identifier: Apache-2.0
#include "memory.h"

#include <algorithm>
#include <cmath>

#include "job.h"
#include "sarnerf/core/error.h"
#include "sarnerf/render/surface_engine.h"
#include "values.h"

namespace sarnerf::app {
namespace {

/// The program, its libraries and small change.
constexpr std::uint64_t kProgramBytes = 48'000'000;

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

std::uint64_t largest_plan_bytes(const Job& job) {
  std::uint64_t largest = 0;
  for (const ViewPlan& plan : job.plans) largest = std::max(largest, plan.memory_bytes);
  const std::uint64_t layer_bytes = kLayerCopies * bytes_per_pixel(job.options.layers);
  return largest + n_pixels(*job.options.size) * (kProductBytesPerPixel + layer_bytes);
}

}  // namespace

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
  const std::uint64_t each = largest_plan_bytes(job);
  if (limit != 0 && fixed + each > limit) {
    // Rays and rows grow with the image: count them with its pixels.
    refuse(fixed, fixed + each, each / n_pixels(*job.options.size) + 1, limit);
  }
  const int n_threads = job.options.shared.n_threads;
  const bool enough = job.views.size() >= 2 * static_cast<std::size_t>(n_threads);
  const bool fits = limit == 0 || fixed + each * static_cast<std::uint64_t>(n_threads) <= limit;
  job.n_views_at_once = enough && fits ? n_threads : 1;
  const std::uint64_t built = fixed + each * static_cast<std::uint64_t>(job.n_views_at_once);
  const std::uint64_t building =
      kProgramBytes + scene_bytes(*job.scene) +
      expected_engine_memory_bytes(job.scene->mesh.triangles.size());
  job.memory_bytes = std::max(built, building);
}

}  // namespace sarnerf::app
