// SPDX-License-Identifier: Apache-2.0
#include "slice_media.h"

#include <cmath>
#include <limits>
#include <numeric>

namespace sarnerf {

namespace {

/// Rays through media per pixel, across the rays and, where faces are steep, in range.
constexpr double kRaysPerPixel = 32.0;
/// A medium that attenuates by more than a third of the power within a bin scatters at its surface, each ray into one bin.
constexpr double kRaysPerPixelIfDense = 256.0;
constexpr double kDenseDepth = 0.4;
constexpr double kMostParts = 65536.0;

}  // namespace

SliceMedia::SliceMedia(const Scene& scene, const SliceFrame& frame, const Acquisition& view)
    : scene_(scene),
      frame_(frame),
      spacing_m_(view.range_spacing_m),
      pixel_rad_(std::min(view.range_spacing_m, view.azimuth_spacing_m) / view.slant_range_m),
      inside_(scene.pieces.size(), 0) {}

void SliceMedia::begin_slice(std::span<const SliceLine> lines) {
  lines_ = lines;
  faces_.clear();
  for (const SliceLine& line : lines) {
    const glm::uvec3& c = scene_.mesh.triangles[line.face];
    const auto& v = scene_.mesh.vertices_m;
    const glm::dvec3 normal = glm::cross(v[c.y] - v[c.x], v[c.z] - v[c.x]);
    const double tangent = 0.5 * (line.first + line.last);
    const double along_ray = glm::dot(normal, frame_.radar.k + tangent * frame_.radar.v);
    faces_.push_back({along_ray < 0.0 ? 1.0 : -1.0, scene_.mesh.piece[line.face],
                      &scene_.materials[scene_.mesh.material[line.face]]});
  }
  by_first_.resize(lines.size());
  std::iota(by_first_.begin(), by_first_.end(), 0u);
  std::sort(by_first_.begin(), by_first_.end(),
            [&](std::uint32_t a, std::uint32_t b) { return lines[a].first < lines[b].first; });
  n_begun_ = 0;
  active_.clear();
}

void SliceMedia::advance(double first) {
  std::erase_if(active_, [&](std::uint32_t n) { return lines_[n].last <= first; });
  while (n_begun_ < by_first_.size() && lines_[by_first_[n_begun_]].first <= first) {
    active_.push_back(by_first_[n_begun_++]);
  }
}

int SliceMedia::n_parts(double first, double last) const {
  double pixels = SliceFrame::angle_between(first, last) / pixel_rad_;
  double densest_per_m = 0.0;
  for (const std::uint32_t n : active_) {
    const Material& medium = *faces_[n].medium;
    densest_per_m = std::max(densest_per_m, medium.extinction_per_m + medium.extinction_back_per_m);
    pixels = std::max(pixels, std::abs(frame_.bin_at(lines_[n], last) - frame_.bin_at(lines_[n], first)));
  }
  const double rays = densest_per_m * spacing_m_ > kDenseDepth ? kRaysPerPixelIfDense : kRaysPerPixel;
  return static_cast<int>(std::clamp(std::ceil(pixels * rays), 1.0, kMostParts));
}

double SliceMedia::integrate(double tangent, double end, double weight, std::span<double> bins) {
  boundaries_.clear();
  for (const std::uint32_t n : active_) boundaries_.push_back({frame_.bin_at(lines_[n], tangent), n});
  std::sort(boundaries_.begin(), boundaries_.end(),
            [](const Boundary& a, const Boundary& b) { return a.bin < b.bin; });
  for (const Boundary& b : boundaries_) inside_[faces_[b.line].piece] = 0;

  const double last_bin = static_cast<double>(bins.size());
  double extinction_per_m = 0.0, scattering_per_m = 0.0, depth = 0.0;
  for (std::size_t n = 0; n + 1 < boundaries_.size(); ++n) {
    const Face& face = faces_[boundaries_[n].line];
    int& inside = inside_[face.piece];
    const bool was_inside = inside > 0;
    inside += face.enters > 0.0 ? 1 : -1;
    if (was_inside != (inside > 0)) {
      const double sign = was_inside ? -1.0 : 1.0;
      extinction_per_m += sign * (face.medium->extinction_per_m + face.medium->extinction_back_per_m);
      scattering_per_m += sign * face.medium->scattering_per_m;
    }
    if (std::max(extinction_per_m, scattering_per_m) <= 0.0) continue;
    double x = boundaries_[n].bin;
    const double x_end = std::min(boundaries_[n + 1].bin, end);
    while (x < x_end) {
      const double next = x < 0.0          ? std::min(0.0, x_end)
                          : x < last_bin   ? std::min(std::floor(x) + 1.0, x_end)
                                           : x_end;
      const double length_m = (next - x) * spacing_m_, lost = std::max(0.0, extinction_per_m) * length_m;
      if (x >= 0.0 && x < last_bin) {
        const double mean = lost > 0.0 ? -std::expm1(-lost) / lost : 1.0;
        bins[static_cast<std::size_t>(x)] += weight * scattering_per_m * length_m * std::exp(-depth) * mean;
      }
      depth += lost;
      x = next;
    }
  }
  return std::exp(-depth);
}

}  // namespace sarnerf
