// SPDX-License-Identifier: Apache-2.0
#include "ground_height.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "median_ground.h"
#include "sarnerf/core/gaussian_blur.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/background.h"

namespace sarnerf {
namespace {

using Views = std::span<const PosedImage>;

constexpr std::size_t kLeastViews = 6;

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

}  // namespace sarnerf
