// SPDX-License-Identifier: Apache-2.0
// The height of the ground: where the textures that the views show agree (ground.h has the equations).
#include <algorithm>
#include <array>
#include <cmath>

#include "ground_steps.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"

namespace sarnerf::ground {

namespace {

/// Blurred relative deviation of a view's masked pixels from their mean.
struct Deviation {
  Image<float> value;
  Image<float> counts;  ///< 1 where `value` is defined, else 0
};

Deviation deviation_of(const Image<float>& power, const Mask& mask, const GroundRule& rule) {
  Deviation d{Image<float>(power.n_azimuth(), power.n_range()), Image<float>(power.n_azimuth(), power.n_range())};
  const double sum = masked_sum(power, mask);
  if (!(sum > 0.0)) return d;
  const auto mean = static_cast<float>(sum / masked_pixels(mask));
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    if (mask.pixels()[n] == 0) continue;
    d.counts.pixels()[n] = 1.0f;
    d.value.pixels()[n] = power.pixels()[n] / mean - 1.0f;
  }
  d.value = gaussian_blur(d.value, rule.height_sigma_pixels);
  const Image<float> part = gaussian_blur(d.counts, rule.height_sigma_pixels);
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    const bool counts = mask.pixels()[n] != 0 && part.pixels()[n] > 0.5f;
    d.counts.pixels()[n] = counts ? 1.0f : 0.0f;
    d.value.pixels()[n] *= counts ? 1.0f / part.pixels()[n] : 0.0f;
  }
  return d;
}

/// Square cells of the plane: two pixels wide, or wider where more than about 96 would lie along the box. This limits the cost.
struct Cells {
  double size_m, first_x_m, first_z_m;
  int n_x, n_z;
};

Cells cells_of(const Box& box_m, double pixel_m) {
  constexpr int kMostCells = 96;
  const glm::dvec3 size = box_m.size();
  const double cell_m = std::max(2.0 * pixel_m, std::max(size.x, size.z) / kMostCells);
  return {cell_m, box_m.min.x, box_m.min.z, static_cast<int>(size.x / cell_m) + 1, static_cast<int>(size.z / cell_m) + 1};
}

/// V (ground.h) and the mean square of single deviations, over cells that more than half of the views show as ground.
struct Agreement {
  double covariance_sum = 0.0, variance_sum = 0.0, n_cells = 0.0;

  double covariance() const { return n_cells > 0.0 ? covariance_sum / n_cells : 0.0; }
  double variance() const { return n_cells > 0.0 ? variance_sum / n_cells : 0.0; }
  Agreement& operator+=(const Agreement& other) {
    covariance_sum += other.covariance_sum;
    variance_sum += other.variance_sum;
    n_cells += other.n_cells;
    return *this;
  }
};

/// Square regions of the plane, this number along each side.
constexpr std::size_t kRegionsAlong = 8;
using Regions = std::array<Agreement, kRegionsAlong * kRegionsAlong>;

Agreement sum_of(const Regions& regions) {
  Agreement sum;
  for (const Agreement& region : regions) sum += region;
  return sum;
}

/// V over its standard error, which follows from the scatter of V between regions.
double significance_of(const Regions& regions) {
  const double mean = sum_of(regions).covariance();
  double sum = 0.0, squares = 0.0;
  for (const Agreement& region : regions) {
    const double deviation = region.covariance_sum - mean * region.n_cells;
    sum += region.covariance_sum;
    squares += deviation * deviation;
  }
  return squares > 0.0 ? sum / std::sqrt(squares) : 0.0;
}

Regions agreement_at(double height_m, Views images, std::span<const RadarFrame> frames,
                     std::span<const Deviation> deviations, const Cells& cells) {
  std::vector<std::array<Agreement, kRegionsAlong>> of_row(static_cast<std::size_t>(cells.n_x));
  parallel_for(of_row.size(), 4, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t x = begin; x < end; ++x)
      for (int z = 0; z < cells.n_z; ++z) {
        const glm::dvec3 point_m(cells.first_x_m + static_cast<double>(x) * cells.size_m, height_m,
                                 cells.first_z_m + z * cells.size_m);
        double sum = 0.0, squares = 0.0, n = 0.0;
        for (std::size_t v = 0; v < images.size(); ++v) {
          const Acquisition& a = images[v].acquisition;
          const std::optional<glm::ivec2> at = pixel_of(a, project(a, frames[v], point_m));
          if (!at || deviations[v].counts(at->x, at->y) == 0.0f) continue;
          const double r = double{deviations[v].value(at->x, at->y)};
          sum += r;
          squares += r * r;
          n += 1.0;
        }
        if (!(n > 1.0 && 2.0 * n > static_cast<double>(images.size()))) continue;
        of_row[x][static_cast<std::size_t>(z) * kRegionsAlong / static_cast<std::size_t>(cells.n_z)] +=
            {(sum * sum - squares) / (n * (n - 1.0)), squares / n, 1.0};
      }
  });
  Regions regions{};
  for (std::size_t x = 0; x < of_row.size(); ++x)
    for (std::size_t r = 0; r < kRegionsAlong; ++r)
      regions[x * kRegionsAlong / of_row.size() * kRegionsAlong + r] += of_row[x][r];
  return regions;
}

/// Standard deviation of V if the views' deviations are independent; unblurred speckle is taken to be a pixel wide.
double noise_of(const Agreement& agreement, std::size_t n_views, double cell_m, double pixel_m, double sigma_pixels) {
  const double spread_m2 = 4.0 * kPi * (sigma_pixels * sigma_pixels + 1.0) * pixel_m * pixel_m;
  const double n_independent = std::max(1.0, agreement.n_cells * std::min(1.0, cell_m * cell_m / spread_m2));
  const double pairs = 0.5 * static_cast<double>(n_views) * static_cast<double>(n_views - 1);
  return agreement.variance() / std::sqrt(pairs * n_independent);
}

/// The views of a scene, and what of them is compared.
struct Evidence {
  Views images;
  std::vector<RadarFrame> frames;
  std::vector<Deviation> deviations;
};

Evidence evidence_of(Views images, std::span<const Mask> masks, const GroundRule& rule) {
  Evidence evidence{images, frames_of(images), std::vector<Deviation>(images.size())};
  for_each_view(images, [&](std::size_t v) { evidence.deviations[v] = deviation_of(images[v].power, masks[v], rule); });
  return evidence;
}

struct AgreedHeight {
  double height_m;
  double over_bottom;  ///< V there minus V at the bottom of the box, over the standard deviation of V under independent speckle
};

/// The height at which masked views agree best, if the agreement is significant and the height below the box's top. Of several
/// scenes, each agrees with itself alone, and V is the mean over all their cells.
std::optional<AgreedHeight> agreed_height(std::span<const Evidence> scenes, const Box& box_m, const GroundRule& rule) {
  const Acquisition& first = scenes.front().images.front().acquisition;
  const double pixel_m = std::max(first.azimuth_spacing_m, first.range_spacing_m);
  double step_m = 0.0;  // for the view whose ranges change least with height
  for (const Evidence& scene : scenes)
    for (const PosedImage& image : scene.images)
      step_m = std::max(step_m, rule.height_step_pixels * image.acquisition.range_spacing_m /
                                    std::cos(image.acquisition.incidence_rad));
  const Cells cells = cells_of(box_m, pixel_m);
  const int n_steps = static_cast<int>(std::lround(rule.height_reach_pixels / rule.height_step_pixels));
  std::vector<Regions> agreement(static_cast<std::size_t>(2 * n_steps + 1));
  double squares = 0.0, n_cells = 0.0;  // of V's noise at the bottom of the box
  for (const Evidence& scene : scenes)
    for (int n = -n_steps; n <= n_steps; ++n) {
      const Regions of_scene = agreement_at(box_m.min.y + n * step_m, scene.images, scene.frames, scene.deviations, cells);
      Regions& sum = agreement[static_cast<std::size_t>(n + n_steps)];
      for (std::size_t r = 0; r < sum.size(); ++r) sum[r] += of_scene[r];
      if (n != 0) continue;
      const Agreement total = sum_of(of_scene);
      const double noise = noise_of(total, scene.images.size(), cells.size_m, pixel_m, rule.height_sigma_pixels);
      squares += total.n_cells * total.n_cells * noise * noise;
      n_cells += total.n_cells;
    }
  const auto at = [&](int n) -> const Regions& { return agreement[static_cast<std::size_t>(n + n_steps)]; };
  const auto covariance = [&](int n) { return sum_of(at(n)).covariance(); };
  int best = 0;
  for (int n = -n_steps; n <= n_steps; ++n)
    if (covariance(n) > covariance(best)) best = n;
  // If the best height is the lowest or highest one tried, the true height lies beyond it, or there is none.
  if (std::abs(best) == n_steps || !(n_cells > 0.0)) return {};
  if (!(significance_of(at(best)) > rule.height_significance)) return {};
  const double top = top_of_parabola(covariance(best - 1), covariance(best), covariance(best + 1));
  const double height_m = box_m.min.y + (best + top) * step_m;
  if (!(height_m < box_m.max.y)) return {};
  return AgreedHeight{height_m, (covariance(best) - covariance(0)) * n_cells / std::sqrt(squares)};
}

}  // namespace

std::optional<double> agreed_height_m(Views images, std::span<const Mask> masks, const Box& box_m, const GroundRule& rule) {
  const Evidence evidence = evidence_of(images, masks, rule);
  const std::optional<AgreedHeight> agreed = agreed_height(std::span(&evidence, 1), box_m, rule);
  return agreed && agreed->over_bottom > rule.height_significance ? std::optional(agreed->height_m) : std::nullopt;
}

}  // namespace sarnerf::ground

namespace sarnerf {

std::optional<double> common_ground_height_m(std::span<const std::vector<PosedImage>> scenes, const Box& box_m,
                                             const GroundRule& rule) {
  using namespace ground;
  std::vector<Evidence> evidence;
  for (const std::vector<PosedImage>& images : scenes)
    if (images.size() > 1) evidence.push_back(evidence_of(images, uniform_ground(images, rule).mask, rule));
  if (evidence.empty()) return {};
  const std::optional<AgreedHeight> agreed = agreed_height(evidence, box_m, rule);
  return agreed ? std::optional(agreed->height_m) : std::nullopt;
}

}  // namespace sarnerf
