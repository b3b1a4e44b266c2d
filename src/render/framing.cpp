// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/render/framing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {
namespace {

constexpr int kMarginPixels = 4;
constexpr double kMaxPixels = 65535.0;

double height_of_reference_m(const Scene& scene) {
  if (scene.ground) return scene.ground->height_m;
  return scene.box.empty() ? 0.0 : scene.box.min.y;
}

/// Extents of the scene in one image, relative to the aim point.
struct ImageExtent {
  double along_m = 0.0;  ///< largest |a|
  double near_m = 0.0;   ///< smallest range offset: the tip of the layover
  double far_m = 0.0;    ///< largest range offset of the scene
  double shadow_m = 0.0;  ///< largest range offset of shadow on the reference plane
};

/// Distance of the radar, the origin, to the convex hull of `points` in the plane across the track; 0 inside. Beneath the radar the
/// nearest point of a box lies on an edge or a face, not at a corner. Some 8 points: every pair is tried.
double distance_to_hull_m(std::span<const glm::dvec2> points) {
  glm::dvec2 nearest = points.front();
  for (std::size_t n = 0; n < points.size(); ++n)
    for (std::size_t other = n + 1; other < points.size(); ++other) {
      const glm::dvec2 from = points[n], along = points[other] - from;
      const double square = glm::dot(along, along);
      const double t = square > 0.0 ? std::clamp(-glm::dot(from, along) / square, 0.0, 1.0) : 0.0;
      const glm::dvec2 candidate = from + t * along;
      if (glm::dot(candidate, candidate) < glm::dot(nearest, nearest)) nearest = candidate;
    }
  // From outside, the whole hull lies behind the line through its nearest point.
  const double square = glm::dot(nearest, nearest);
  const bool outside =
      std::all_of(points.begin(), points.end(), [&](const glm::dvec2& p) { return glm::dot(p, nearest) >= (1.0 - 1e-9) * square; });
  return outside ? std::sqrt(square) : 0.0;
}

ImageExtent extent_in_image(const Box& box, double reference_m, const Acquisition& a) {
  const RadarFrame frame = radar_frame(a);
  const double height_of_radar = a.altitude_m() + a.aim_m.y - reference_m;
  ImageExtent extent{0.0, std::numeric_limits<double>::infinity(),
                     -std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  std::vector<glm::dvec2> across_track;  // of the corners, in the radar's range plane
  for (const glm::dvec3& corner : box.corners()) {
    const RadarPoint p = project(a, frame, corner);
    across_track.push_back((a.slant_range_m + p.range_offset_m) *
                           glm::dvec2(std::cos(p.ray_angle_rad), std::sin(p.ray_angle_rad)));
    extent.along_m = std::max(extent.along_m, std::abs(p.along_track_m));
    extent.near_m = std::min(extent.near_m, p.range_offset_m);
    extent.far_m = std::max(extent.far_m, p.range_offset_m);
    // The shadow of a point lies where its ray meets the reference plane.
    const double below = height_of_radar - (a.altitude_m() + a.aim_m.y - corner.y);
    const double cosine = std::cos(a.incidence_rad + p.ray_angle_rad);
    const double behind_m = cosine > 1e-6 ? std::max(0.0, below) / cosine : 0.0;
    extent.shadow_m = std::max(extent.shadow_m, p.range_offset_m + behind_m);
  }
  extent.near_m = std::min(extent.near_m, distance_to_hull_m(across_track) - a.slant_range_m);
  return extent;
}

/// Along-track coordinates between which the box lies (m).
std::pair<double, double> extent_along(const Box& box, const Acquisition& view) {
  const RadarFrame frame = radar_frame(view);
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const glm::dvec3& corner : box.corners()) {
    const double along = glm::dot(corner - view.aim_m, frame.h);
    first = std::min(first, along);
    last = std::max(last, along);
  }
  return {first, last};
}

int pixels_for(const Scene& scene, double half_m, double spacing_m) {
  const double n = 2.0 * (std::ceil(half_m / spacing_m) + kMarginPixels);
  if (!(n <= kMaxPixels)) {
    char text[256];
    std::snprintf(text, sizeof text,
                  "holding the scene would take an image of %.3g pixels a side at %.4g m spacing; "
                  "widen --spacing, or give --size; ",
                  n, spacing_m);
    throw UsageError(text + scene_size_hint(scene));
  }
  return static_cast<int>(n);
}

}  // namespace

glm::dvec3 default_aim_m(const Scene& scene) {
  if (scene.box.empty()) return {0.0, height_of_reference_m(scene), 0.0};
  const glm::dvec3 centre = scene.box.centre();
  return {centre.x, scene.box.min.y, centre.z};
}

Framing frame_scene(const Scene& scene, std::span<const Acquisition> views, std::optional<double> reference_height_m) {
  if (scene.box.empty()) {
    return {128, 128, "is the default: a ground alone has no extent to fit"};
  }
  double half_along = 0.0, half_range = 0.0;
  double near_m = std::numeric_limits<double>::infinity(), far_m = -near_m;
  double nearest_m = near_m;  // smallest slant range of the aim point
  for (const Acquisition& view : views) {
    const ImageExtent e = extent_in_image(scene.box, reference_height_m.value_or(height_of_reference_m(scene)), view);
    half_along = std::max(half_along, e.along_m);
    half_range = std::max({half_range, -e.near_m, e.far_m, e.shadow_m});
    near_m = std::min(near_m, e.near_m);
    far_m = std::max({far_m, e.far_m, e.shadow_m});
    nearest_m = std::min(nearest_m, view.slant_range_m);
  }
  const Acquisition& first = views.front();
  Framing framing;
  framing.n_azimuth = pixels_for(scene, half_along, first.azimuth_spacing_m);
  // For a scene close to the radar, the image ends at the radar: there are no ranges below zero.
  const double most = std::max(1.0, std::ceil(2.0 * nearest_m / first.range_spacing_m) - 1.0);
  framing.n_range = pixels_for(scene, std::min(half_range, nearest_m), first.range_spacing_m);
  const bool cut = framing.n_range > most;
  if (cut) framing.n_range = static_cast<int>(most);
  const glm::dvec3 size = scene.box.size();
  char text[320];
  std::snprintf(text, sizeof text,
                "fits the scene of %.4g x %.4g x %.4g m, its layover "
                "(from %.4g m %s the aim point) and its shadow (to %.4g m %s it%s)%s",
                size.x, size.y, size.z, std::abs(near_m),
                near_m <= 0.0 ? "before" : "beyond", std::abs(far_m), far_m >= 0.0 ? "beyond" : "before",
                views.size() > 1 ? ", all views" : "",
                cut ? ", as far as ranges above zero allow" : "");
  framing.explanation = text;
  return framing;
}

std::string scene_size_hint(const Scene& scene) {
  if (scene.box.empty()) return {};
  const glm::dvec3 size_m = scene.box.size();
  const double most_m = std::max({size_m.x, size_m.y, size_m.z});
  const std::string length = most_m < 1000.0 ? format("%.4g m", most_m) : format("%.4g km", 1e-3 * most_m);
  return "the scene measures " + length + ": is it in other units (--units mm, or \"units\" in a scene file)?";
}

std::string few_pixels_warning(const Scene& scene, const Acquisition& view) {
  if (scene.box.empty()) return {};
  const auto [first_along, last_along] = extent_along(scene.box, view);
  const ImageExtent e = extent_in_image(scene.box, height_of_reference_m(scene), view);
  const double along_m = last_along - first_along, range_m = e.far_m - e.near_m;
  if (along_m >= 2.0 * view.azimuth_spacing_m || range_m >= 2.0 * view.range_spacing_m) return {};
  char text[256];
  std::snprintf(text, sizeof text,
                "the scene measures %.3g x %.3g pixels (azimuth x range, %.3g x %.3g m): check --units, --scale "
                "and --spacing",
                along_m / view.azimuth_spacing_m, range_m / view.range_spacing_m, along_m, range_m);
  return text;
}

std::string outside_swath_warning(const Scene& scene, const Acquisition& view) {
  if (scene.box.empty()) return {};
  const ImageExtent e = extent_in_image(scene.box, height_of_reference_m(scene), view);
  const auto [first_along, last_along] = extent_along(scene.box, view);
  const double half_rows = 0.5 * view.n_azimuth * view.azimuth_spacing_m;
  const double half_bins = 0.5 * view.n_range * view.range_spacing_m;
  const bool outside = first_along >= half_rows || last_along <= -half_rows ||
                       e.near_m >= half_bins || e.far_m <= -half_bins;
  const bool cut = first_along < -half_rows || last_along > half_rows || e.near_m < -half_bins ||
                   e.far_m > half_bins;
  if (!outside && !cut) return {};
  char text[384];
  std::snprintf(text, sizeof text,
                "the scene lies %s the swath: rows %.4g to %.4g m and range %.4g to %.4g m from the aim "
                "point, but the image ends at +-%.4g m and +-%.4g m; check --aim, --size, --spacing",
                outside ? "outside" : "partly outside", first_along, last_along, e.near_m, e.far_m,
                half_rows, half_bins);
  return text;
}

}  // namespace sarnerf
