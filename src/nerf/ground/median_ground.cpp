// SPDX-License-Identifier: Apache-2.0
#include "ground/median_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

double LevelGround::texture_at(double x_m, double z_m) const {
  const double x = std::clamp((x_m - first_x_m) / cell_m, 0.0, texture.n_azimuth() - 1.0);
  const double z = std::clamp((z_m - first_z_m) / cell_m, 0.0, texture.n_range() - 1.0);
  return bilinear(texture, x, z);
}

double LevelGround::gain_at(double wanted_rad) const {
  const auto above = std::upper_bound(incidence_rad.begin(), incidence_rad.end(), wanted_rad) - incidence_rad.begin();
  if (above == 0) return gain.front();
  const auto n = static_cast<std::size_t>(above);
  if (n == gain.size()) return gain.back();
  const double part = (wanted_rad - incidence_rad[n - 1]) / (incidence_rad[n] - incidence_rad[n - 1]);
  return gain[n - 1] + part * (gain[n] - gain[n - 1]);
}

double LevelGround::mean_power() const {
  double sum = 0.0;
  for (const float t : texture.pixels()) sum += double{t};
  return sum * gain.front() / static_cast<double>(texture.pixels().size());
}

GroundBins ground_bins(const LevelGround& ground, const Acquisition& a, int row) {
  const RadarFrame frame = radar_frame(a);
  const glm::dvec3 away = level_range_direction(a);
  const double gain = ground.gain_at(a.incidence_rad), along_track_m = a.row_offset_m(row);
  GroundBins bins;
  for (const double offset_m : plane_offsets_m(a, ground.height_m)) {
    if (std::isnan(offset_m)) {
      bins.angle_rad.push_back(std::numeric_limits<double>::quiet_NaN());
      bins.power.push_back(0.0f);
      continue;
    }
    const glm::dvec3 point_m = along_track_m * frame.h + offset_m * away + glm::dvec3(0.0, ground.height_m, 0.0);
    bins.angle_rad.push_back(project(a, frame, point_m).ray_angle_rad);
    bins.power.push_back(static_cast<float>(gain * ground.texture_at(point_m.x, point_m.z)));
  }
  return bins;
}

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
  const double i = a.row_of(p.along_track_m);
  const double j = a.bin_of(p.range_offset_m);
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

namespace {

using Views = std::span<const PosedImage>;

/// Heights are a step apart that moves the ground by half a pixel of slant range, to either side of the box's bottom.
constexpr double kStep_pixels = 0.5;
constexpr int kSteps = 12;

/// Standard deviations (pixels): of what tells ground from what stands on it, of views that are compared, and of what
/// speckle itself is blurred by.
constexpr double kSurroundings = 1.5, kBlur = 1.0, kSpeckle = 1.0;

/// Surroundings of ground are between half and twice as bright as the median.
constexpr float kAlike = 2.0f;

/// Cells are two pixels wide, or as wide that no more than so many lie along the box.
constexpr int kMostCells = 96;

/// Of V(h) over that at the bottom, in standard deviations of independent speckle's.
constexpr double kSignificant = 3.5;

/// A view's ground: relative deviation from its mean brightness, blurred, and where there is any.
struct Deviation {
  Image<float> value;
  Image<float> is_ground;  ///< 1 or 0
};

Deviation deviation_of(const Image<float>& power) {
  const Image<float> around = gaussian_blur(power, kSurroundings);
  std::vector<double> values(around.pixels().begin(), around.pixels().end());
  const auto usual = static_cast<float>(median(values));
  Deviation d{Image<float>(power.n_azimuth(), power.n_range()), Image<float>(power.n_azimuth(), power.n_range())};
  double sum = 0.0, n_ground = 0.0;
  for (std::size_t n = 0; n < around.pixels().size(); ++n) {
    const float a = around.pixels()[n];
    if (!(a * kAlike > usual && a < kAlike * usual)) continue;
    d.is_ground.pixels()[n] = 1.0f;
    sum += double{power.pixels()[n]};
    n_ground += 1.0;
  }
  if (!(sum > 0.0)) return d;
  const auto mean = static_cast<float>(sum / n_ground);
  for (std::size_t n = 0; n < around.pixels().size(); ++n)
    d.value.pixels()[n] = d.is_ground.pixels()[n] * (power.pixels()[n] / mean - 1.0f);
  d.value = gaussian_blur(d.value, kBlur);
  const Image<float> part = gaussian_blur(d.is_ground, kBlur);
  for (std::size_t n = 0; n < part.pixels().size(); ++n) {
    const bool counts = d.is_ground.pixels()[n] != 0.0f && part.pixels()[n] > 0.5f;
    d.is_ground.pixels()[n] = counts ? 1.0f : 0.0f;
    d.value.pixels()[n] *= counts ? 1.0f / part.pixels()[n] : 0.0f;
  }
  return d;
}

/// The plane in square cells.
struct Cells {
  double size_m, first_x_m, first_z_m;
  int n_x, n_z;
};

Cells cells_of(const Box& box_m, double pixel_m) {
  const glm::dvec3 size = box_m.size();
  const double cell_m = std::max(2.0 * pixel_m, std::max(size.x, size.z) / kMostCells);
  return {cell_m, box_m.min.x, box_m.min.z, static_cast<int>(size.x / cell_m) + 1, static_cast<int>(size.z / cell_m) + 1};
}

/// V, and the mean square of single deviations, over cells that more than half of the views show as ground.
struct Likeness {
  double covariance = 0.0, variance = 0.0, n_cells = 0.0;
};

Likeness likeness_at(double height_m, Views images, std::span<const RadarFrame> frames,
                     std::span<const Deviation> deviations, const Cells& cells) {
  std::vector<Likeness> of_row(static_cast<std::size_t>(cells.n_x));
  parallel_for(of_row.size(), 4, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t x = begin; x < end; ++x)
      for (int z = 0; z < cells.n_z; ++z) {
        const glm::dvec3 point_m(cells.first_x_m + static_cast<double>(x) * cells.size_m, height_m,
                                 cells.first_z_m + z * cells.size_m);
        double sum = 0.0, squares = 0.0, n = 0.0;
        for (std::size_t v = 0; v < images.size(); ++v) {
          const Acquisition& a = images[v].acquisition;
          const std::optional<glm::ivec2> at = pixel_of(a, project(a, frames[v], point_m));
          if (!at || deviations[v].is_ground(at->x, at->y) == 0.0f) continue;
          const double r = double{deviations[v].value(at->x, at->y)};
          sum += r;
          squares += r * r;
          n += 1.0;
        }
        if (!(n > 1.0 && 2.0 * n > static_cast<double>(images.size()))) continue;
        of_row[x].covariance += (sum * sum - squares) / (n * (n - 1.0));
        of_row[x].variance += squares / n;
        of_row[x].n_cells += 1.0;
      }
  });
  Likeness all;
  for (const Likeness& row : of_row) {
    all.covariance += row.covariance;
    all.variance += row.variance;
    all.n_cells += row.n_cells;
  }
  if (all.n_cells > 0.0) {
    all.covariance /= all.n_cells;
    all.variance /= all.n_cells;
  }
  return all;
}

/// Standard deviation of V where the views' deviations are independent.
double noise_of(const Likeness& likeness, std::size_t n_views, double cell_m, double pixel_m) {
  const double spread_m2 = 4.0 * kPi * (kBlur * kBlur + kSpeckle * kSpeckle) * pixel_m * pixel_m;
  const double n_independent = std::max(1.0, likeness.n_cells * std::min(1.0, cell_m * cell_m / spread_m2));
  const double pairs = 0.5 * static_cast<double>(n_views) * static_cast<double>(n_views - 1);
  return likeness.variance / std::sqrt(pairs * n_independent);
}

/// Where the parabola through three values, the middle one the largest, has its top, in steps from the middle.
double top_of_parabola(double before, double middle, double after) {
  const double bend = before - 2.0 * middle + after;
  return bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

}  // namespace

std::optional<double> ground_height_m(Views images, const Box& box_m) {
  if (images.size() < kLeastViews || !is_speckled(images)) return {};
  const Acquisition& first = images.front().acquisition;
  const double pixel_m = std::max(first.azimuth_spacing_m, first.range_spacing_m);
  double step_m = 0.0;  // the views that see heights the least need the longest
  std::vector<RadarFrame> frames;
  for (const PosedImage& image : images) {
    frames.push_back(radar_frame(image.acquisition));
    step_m = std::max(step_m, kStep_pixels * image.acquisition.range_spacing_m / std::cos(image.acquisition.incidence_rad));
  }
  std::vector<Deviation> deviations(images.size());
  parallel_for(images.size(), 1, [&](std::size_t v, std::size_t, int) { deviations[v] = deviation_of(images[v].power); });

  const Cells cells = cells_of(box_m, pixel_m);
  std::vector<Likeness> likeness;
  for (int n = -kSteps; n <= kSteps; ++n)
    likeness.push_back(likeness_at(box_m.min.y + n * step_m, images, frames, deviations, cells));
  const auto at = [&](int n) -> const Likeness& { return likeness[static_cast<std::size_t>(n + kSteps)]; };
  int best = 0;
  for (int n = -kSteps; n <= kSteps; ++n)
    if (at(n).covariance > at(best).covariance) best = n;
  const double noise = noise_of(at(0), images.size(), cells.size_m, pixel_m);
  // At the end of the row the true height lies beyond, or there is none.
  if (std::abs(best) == kSteps || !(at(best).covariance - at(0).covariance > kSignificant * noise)) return {};
  const double top = top_of_parabola(at(best - 1).covariance, at(best).covariance, at(best + 1).covariance);
  const double height_m = box_m.min.y + (best + top) * step_m;
  return height_m < box_m.max.y ? std::optional(height_m) : std::nullopt;
}

namespace {

/// Room at the borders: matter begins up to some voxels above the plane.
constexpr int kMargin_bins = 4;

/// Ray angle at which each bin sees the plane; −∞ in bins nearer than the plane.
std::vector<double> plane_angles(const Acquisition& a, double height_m) {
  const RadarFrame frame = radar_frame(a);
  const glm::dvec3 away = level_range_direction(a);
  std::vector<double> angles;
  for (const double offset_m : plane_offsets_m(a, height_m)) {
    const glm::dvec3 point_m = offset_m * away + glm::dvec3(0.0, height_m, 0.0);
    angles.push_back(std::isnan(offset_m) ? -std::numeric_limits<double>::infinity()
                                          : project(a, frame, point_m).ray_angle_rad);
  }
  return angles;
}

}  // namespace

StandingView standing_view(const Acquisition& a, const Box& standing_m, double ground_height_m) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (standing_m.empty()) return {-kInfinity, kInfinity, 0, 0};
  const RadarFrame frame = radar_frame(a);
  double nearest_m = kInfinity;
  for (const glm::dvec3& corner : standing_m.corners())
    nearest_m = std::min(nearest_m, project(a, frame, corner).range_offset_m);
  const std::vector<double> angle = plane_angles(a, ground_height_m);
  const double last_angle = angular_extent(a, standing_m).second;
  const auto shadow_end = static_cast<int>(std::upper_bound(angle.begin(), angle.end(), last_angle) - angle.begin());

  const auto nearest_bin = static_cast<int>(std::floor(std::clamp(a.bin_of(nearest_m), 0.0, double(a.n_range))));
  StandingView view{-kInfinity, kInfinity, std::max(0, nearest_bin - kMargin_bins),
                    std::min(a.n_range, shadow_end + kMargin_bins)};
  if (view.first_bin >= kMargin_bins)
    view.least_angle_rad = angle[static_cast<std::size_t>(view.first_bin - kMargin_bins)];
  if (view.end_bin + kMargin_bins < a.n_range)
    view.most_angle_rad = angle[static_cast<std::size_t>(view.end_bin + kMargin_bins)];
  return view;
}

}  // namespace sarnerf
