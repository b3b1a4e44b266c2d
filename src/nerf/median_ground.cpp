// SPDX-License-Identifier: Apache-2.0
#include "median_ground.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "sarnerf/core/bilinear.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/level_plane.h"

namespace sarnerf {
namespace {

using Views = std::span<const PosedImage>;

constexpr std::size_t kLeastViews = 6, kMostViews = 48;
/// Rounds of estimating the views' gains and the texture from one another.
constexpr int kRounds = 2;
/// Cells of the texture beyond the box: pixels at its border are looked up between cells.
constexpr int kBorder = 4;

double median_of_positive(const Image<float>& image) {
  std::vector<double> values;
  for (const float p : image.pixels())
    if (p > 0.0f) values.push_back(double{p});
  return median(values);
}

/// Value of a view at a point of the plane; negative outside of its swath, which goes on for a pixel here, so that cells
/// around its outermost pixels have values.
double seen(const PosedImage& image, const RadarFrame& frame, const glm::dvec3& point_m) {
  const Acquisition& a = image.acquisition;
  const RadarPoint p = project(a, frame, point_m);
  const double i = p.along_track_m / a.azimuth_spacing_m + 0.5 * (a.n_azimuth - 1);
  const double j = p.range_offset_m / a.range_spacing_m + 0.5 * (a.n_range - 1);
  if (i < -1.0 || i > a.n_azimuth || j < -1.0 || j > a.n_range) return -1.0;
  return bilinear(image.power, std::clamp(i, 0.0, a.n_azimuth - 1.0), std::clamp(j, 0.0, a.n_range - 1.0));
}

/// Views spread evenly over the set.
std::vector<std::size_t> spread(std::size_t n) {
  const std::size_t n_chosen = std::min(n, kMostViews);
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < n_chosen; ++k) chosen.push_back(k * n / n_chosen);
  return chosen;
}

MedianGround empty_ground(Views images, const Box& box_m) {
  MedianGround ground;
  ground.height_m = box_m.min.y;
  ground.cell_m = images.front().acquisition.range_spacing_m;
  for (const PosedImage& image : images)
    ground.cell_m = std::min({ground.cell_m, image.acquisition.range_spacing_m, image.acquisition.azimuth_spacing_m});
  const glm::dvec3 size = box_m.size();
  const auto n_cells = [&](double side_m) { return static_cast<int>(std::ceil(side_m / ground.cell_m)) + 1 + 2 * kBorder; };
  ground.texture = Image<float>(n_cells(size.x), n_cells(size.z));
  ground.first_x_m = box_m.min.x - kBorder * ground.cell_m;
  ground.first_z_m = box_m.min.z - kBorder * ground.cell_m;
  for (const PosedImage& image : images) ground.gain.push_back(median_of_positive(image.power));
  return ground;
}

void estimate_texture(Views images, std::span<const std::size_t> views, MedianGround& ground) {
  std::vector<RadarFrame> frames;
  for (const std::size_t v : views) frames.push_back(radar_frame(images[v].acquisition));
  parallel_for(static_cast<std::size_t>(ground.texture.n_azimuth()), 4, [&](std::size_t begin, std::size_t end, int) {
    std::vector<double> values;
    for (auto x = static_cast<int>(begin); x < static_cast<int>(end); ++x) {
      for (int z = 0; z < ground.texture.n_range(); ++z) {
        const glm::dvec3 point_m(ground.first_x_m + x * ground.cell_m, ground.height_m, ground.first_z_m + z * ground.cell_m);
        values.clear();
        for (std::size_t n = 0; n < views.size(); ++n) {
          const double gain = ground.gain[views[n]];
          const double value = seen(images[views[n]], frames[n], point_m);
          if (gain > 0.0 && value >= 0.0) values.push_back(value / gain);
        }
        ground.texture(x, z) = static_cast<float>(median(values));
      }
    }
  });
}

/// Calls visit(i, j, x, z) for the pixels of a view that see the plane, in cells of the texture.
template <class Visit>
void for_each_pixel(const Acquisition& a, const MedianGround& ground, Visit&& visit) {
  const std::vector<double> offset_m = plane_offsets_m(a, ground.height_m);
  const glm::dvec3 along_track = radar_frame(a).h, away = level_range_direction(a);
  for (int i = 0; i < a.n_azimuth; ++i) {
    for (int j = 0; j < a.n_range; ++j) {
      const double d = offset_m[static_cast<std::size_t>(j)];
      if (std::isnan(d)) continue;
      const glm::dvec3 p = a.row_offset_m(i) * along_track + d * away;
      visit(i, j, (p.x - ground.first_x_m) / ground.cell_m, (p.z - ground.first_z_m) / ground.cell_m);
    }
  }
}

void estimate_gains(Views images, MedianGround& ground) {
  parallel_for(images.size(), 1, [&](std::size_t v, std::size_t, int) {
    const PosedImage& image = images[v];
    std::vector<double> ratios;
    for_each_pixel(image.acquisition, ground, [&](int i, int j, double x, double z) {
      const double texture = bilinear(ground.texture, x, z);
      if (texture > 0.0) ratios.push_back(double{image.power(i, j)} / texture);
    });
    ground.gain[v] = median(ratios);
  });
}

double deviation(Views images, std::span<const std::size_t> views, const MedianGround& ground) {
  std::vector<double> deviations;
  for (const std::size_t v : views) {
    const PosedImage& image = images[v];
    for_each_pixel(image.acquisition, ground, [&](int i, int j, double x, double z) {
      const double expected = ground.gain[v] * bilinear(ground.texture, x, z);
      deviations.push_back(expected > 0.0 ? std::abs(double{image.power(i, j)} / expected - 1.0) : 1.0);
    });
  }
  return 1.48 * median(deviations);
}

}  // namespace

std::optional<MedianGround> median_ground(Views images, const Box& box_m) {
  if (images.size() < kLeastViews || !has_background(images)) return {};
  MedianGround ground = empty_ground(images, box_m);
  const std::vector<std::size_t> views = spread(images.size());
  for (int round = 0; round < kRounds; ++round) {
    if (round > 0) estimate_gains(images, ground);
    estimate_texture(images, views, ground);
  }
  estimate_gains(images, ground);
  ground.deviation = deviation(images, views, ground);
  return ground;
}

}  // namespace sarnerf
