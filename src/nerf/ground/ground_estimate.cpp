// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

namespace {

using Views = std::span<const PosedImage>;
using Mask = Image<std::uint8_t>;

std::vector<RadarFrame> frames_of(Views images) {
  std::vector<RadarFrame> frames;
  for (const PosedImage& image : images) frames.push_back(radar_frame(image.acquisition));
  return frames;
}

void for_each_view(Views images, const std::function<void(std::size_t)>& visit) {
  parallel_for(images.size(), 1, [&](std::size_t v, std::size_t, int) { visit(v); });
}

/// Means of the blocks that an image is cut into.
std::vector<double> block_means(const Image<float>& power, int side) {
  std::vector<double> means;
  for (int i = 0; i + side <= power.n_azimuth(); i += side)
    for (int j = 0; j + side <= power.n_range(); j += side) {
      double sum = 0.0;
      for (int n = 0; n < side * side; ++n) sum += double{power(i + n / side, j + n % side)};
      means.push_back(sum / (side * side));
    }
  return means;
}

/// Brightness of each pixel's neighbourhood over that of the expected ground.
Image<float> brightness_around(const Image<float>& power, const Image<float>& expected, const GroundRule& rule) {
  Image<float> ratio(power.n_azimuth(), power.n_range());
  for (std::size_t n = 0; n < ratio.pixels().size(); ++n) {
    const float e = expected.pixels()[n];
    ratio.pixels()[n] = e > 0.0f ? power.pixels()[n] / e : 0.0f;
  }
  return gaussian_blur(ratio, rule.mask_sigma_pixels);
}

/// 1 where the brightness of the neighbourhood is within mask_factor of the expected ground; of chips of one object, also wherever that is
/// not.
Mask ground_mask(const Image<float>& power, const Image<float>& expected, const GroundRule& rule) {
  const Image<float> around = brightness_around(power, expected, rule);
  Mask mask(power.n_azimuth(), power.n_range());
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    const double a = double{around.pixels()[n]};
    mask.pixels()[n] = a * rule.mask_factor > 1.0 && a < rule.mask_factor ? 1 : 0;
  }
  if (rule.object_reach_pixels > 0) {
    for (std::uint8_t& pixel : mask.pixels()) pixel = 1 - pixel;
    mask = connected_to_middle(mask, rule.object_reach_pixels);
    for (std::uint8_t& pixel : mask.pixels()) pixel = 1 - pixel;
  }
  return mask;
}

/// Sum of the masked pixels.
double masked_sum(const Image<float>& image, const Mask& mask) {
  double sum = 0.0;
  for (std::size_t n = 0; n < mask.pixels().size(); ++n)
    if (mask.pixels()[n] != 0) sum += double{image.pixels()[n]};
  return sum;
}

double masked_pixels(const Mask& mask) {
  double n = 0.0;
  for (const std::uint8_t m : mask.pixels()) n += m;
  return n;
}

/// Mean power of the cores of shadows: pixels whose neighbourhood is less than 1 / mask_factor as bright as the ground, as it is at all
/// pixels within two σ of the mask's Gaussian, so that no ground and no object beside the shadow is in it. 0 where the images have fewer such
/// pixels than a block: they show no shadow.
double noise_of_shadows(Views images, const LevelGround& plane, std::span<const Mask> masks, const GroundRule& rule) {
  const int reach = static_cast<int>(std::ceil(2.0 * rule.mask_sigma_pixels));
  std::vector<Mask> core(images.size());
  for_each_view(images, [&](std::size_t v) {
    const Image<float> around = brightness_around(images[v].power, ground_image(plane, images[v].acquisition), rule);
    Image<float> lit(around.n_azimuth(), around.n_range());
    for (std::size_t p = 0; p < lit.pixels().size(); ++p)
      lit.pixels()[p] = masks[v].pixels()[p] == 0 && double{around.pixels()[p]} * rule.mask_factor <= 1.0 ? 0.0f : 1.0f;
    const Mask near_lit = target_mask(lit, {.share_of_peak = 0.0, .dilation_pixels = reach});
    core[v] = Mask(lit.n_azimuth(), lit.n_range());
    for (int i = reach; i < lit.n_azimuth() - reach; ++i)  // what lies beyond the border is not known
      for (int j = reach; j < lit.n_range() - reach; ++j) core[v](i, j) = 1 - near_lit(i, j);
  });
  double sum = 0.0, n_pixels = 0.0;
  for (std::size_t v = 0; v < images.size(); ++v) {
    sum += masked_sum(images[v].power, core[v]);
    n_pixels += masked_pixels(core[v]);
  }
  return n_pixels < rule.block_pixels * rule.block_pixels ? 0.0 : sum / n_pixels;
}

}  // namespace

double GroundEstimate::part_of_pixels() const {
  double n_ground = 0.0, n = 0.0;
  for (const Mask& m : mask) {
    n_ground += masked_pixels(m);
    n += static_cast<double>(m.pixels().size());
  }
  return n > 0.0 ? n_ground / n : 0.0;
}

// Height.

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

/// A first guess: each view's gain is the median of its block means, and the ground is uniform.
struct UniformGround {
  std::vector<double> gain;
  std::vector<Mask> mask;
};

UniformGround uniform_ground(Views images, const GroundRule& rule) {
  UniformGround ground{std::vector<double>(images.size()), std::vector<Mask>(images.size())};
  for_each_view(images, [&](std::size_t v) {
    const Image<float>& power = images[v].power;
    ground.gain[v] = median(block_means(power, rule.block_pixels));
    const Image<float> expected(power.n_azimuth(), power.n_range(), static_cast<float>(ground.gain[v]));
    ground.mask[v] = ground_mask(power, expected, rule);
  });
  return ground;
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

/// The height at which masked views agree best, if the agreement is significant and the height below the box's top. Of several
/// scenes, each agrees with itself alone, and V is the mean over all their cells. `bottom_is_likely`: the box stands on the ground unless the
/// views agree significantly better at another height.
std::optional<double> agreed_height_m(std::span<const Evidence> scenes, const Box& box_m, const GroundRule& rule, bool bottom_is_likely) {
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
  if (bottom_is_likely && !(covariance(best) - covariance(0) > rule.height_significance * std::sqrt(squares) / n_cells)) return {};
  if (!(significance_of(at(best)) > rule.height_significance)) return {};
  const double top = top_of_parabola(covariance(best - 1), covariance(best), covariance(best + 1));
  const double height_m = box_m.min.y + (best + top) * step_m;
  return height_m < box_m.max.y ? std::optional(height_m) : std::nullopt;
}

}  // namespace

// Texture.

namespace {

/// The plane under the box, with a uniform texture.
LevelGround uniform_plane(Views images, const Box& box_m, double height_m) {
  // Extra cells on each side of the box: pixels at its border are interpolated between cells.
  constexpr int kBorder = 4;
  LevelGround ground;
  ground.height_m = height_m;
  ground.cell_m = images.front().acquisition.range_spacing_m;
  for (const PosedImage& image : images)
    ground.cell_m = std::min({ground.cell_m, image.acquisition.range_spacing_m, image.acquisition.azimuth_spacing_m});
  const glm::dvec3 size = box_m.size();
  const auto n_cells = [&](double side_m) { return static_cast<int>(std::ceil(side_m / ground.cell_m)) + 1 + 2 * kBorder; };
  ground.texture = Image<float>(n_cells(size.x), n_cells(size.z), 1.0f);
  ground.first_x_m = box_m.min.x - kBorder * ground.cell_m;
  ground.first_z_m = box_m.min.z - kBorder * ground.cell_m;
  return ground;
}

/// For each cell: the mean, over the views, of the masked pixels that see it, divided by the view's gain; number of these views.
struct Texture {
  Image<float> mean, n_views;
};

Texture texture_of(Views images, const LevelGround& ground, std::span<const double> gain, std::span<const Mask> masks,
                   std::size_t first, std::size_t step) {
  const std::vector<RadarFrame> frames = frames_of(images);
  const int n_x = ground.texture.n_azimuth(), n_z = ground.texture.n_range();
  Texture texture{Image<float>(n_x, n_z), Image<float>(n_x, n_z)};
  parallel_for(static_cast<std::size_t>(n_x), 4, [&](std::size_t begin, std::size_t end, int) {
    for (auto x = static_cast<int>(begin); x < static_cast<int>(end); ++x)
      for (int z = 0; z < n_z; ++z) {
        const glm::dvec3 point_m(ground.first_x_m + x * ground.cell_m, ground.height_m,
                                 ground.first_z_m + z * ground.cell_m);
        double sum = 0.0;
        int n = 0;
        for (std::size_t v = first; v < images.size(); v += step) {
          const Acquisition& a = images[v].acquisition;
          const std::optional<glm::ivec2> at = pixel_of(a, project(a, frames[v], point_m));
          if (!at || masks[v](at->x, at->y) == 0 || !(gain[v] > 0.0)) continue;
          sum += double{images[v].power(at->x, at->y)} / gain[v];
          ++n;
        }
        texture.mean(x, z) = n > 0 ? static_cast<float>(sum / n) : 0.0f;
        texture.n_views(x, z) = static_cast<float>(n);
      }
  });
  return texture;
}

double weighted_mean(const Texture& texture) {
  double sum = 0.0, weight = 0.0;
  for (std::size_t n = 0; n < texture.mean.pixels().size(); ++n) {
    sum += double{texture.mean.pixels()[n]} * double{texture.n_views.pixels()[n]};
    weight += double{texture.n_views.pixels()[n]};
  }
  return weight > 0.0 ? sum / weight : 0.0;
}

double square_of_difference(const Image<float>& a, const Image<float>& b, const Image<float>& weight) {
  double sum = 0.0;
  for (std::size_t n = 0; n < weight.pixels().size(); ++n) {
    const double d = double{a.pixels()[n]} - double{b.pixels()[n]};
    sum += double{weight.pixels()[n]} * d * d;
  }
  return sum;
}

/// Gaussian blur, weighted by the views of each cell; the weighted mean where no cell within three standard deviations was seen.
Image<float> smoothed(const Texture& texture, double sigma) {
  const auto otherwise = static_cast<float>(weighted_mean(texture));
  Image<float> seen = texture.mean;
  for (std::size_t n = 0; n < seen.pixels().size(); ++n) seen.pixels()[n] *= texture.n_views.pixels()[n];
  seen = gaussian_blur(seen, sigma);
  const Image<float> weight = gaussian_blur(texture.n_views, sigma);
  for (std::size_t n = 0; n < seen.pixels().size(); ++n) {
    const float w = weight.pixels()[n];
    seen.pixels()[n] = w > 0.0f ? seen.pixels()[n] / w : otherwise;
  }
  return seen;
}

/// The texture, smoothed as half of the views predict the other half best: by one of texture_sigmas_cells, or uniform.
///
/// The texture is scaled so that its mean is the median of the block means: masks are biased, they omit pixels that happen to be
/// bright.
Image<float> smoothed_texture(Views images, const LevelGround& ground, std::span<const double> gain,
                              std::span<const Mask> masks, const GroundRule& rule) {
  const Texture all = texture_of(images, ground, gain, masks, 0, 1), even = texture_of(images, ground, gain, masks, 0, 2),
                odd = texture_of(images, ground, gain, masks, 1, 2);
  const auto error = [&](auto&& smooth) {
    return square_of_difference(smooth(even), odd.mean, odd.n_views) +
           square_of_difference(smooth(odd), even.mean, even.n_views);
  };
  const auto uniform = [](const Texture& t) {
    return Image<float>(t.mean.n_azimuth(), t.mean.n_range(), static_cast<float>(weighted_mean(t)));
  };
  double least = error(uniform);
  Image<float> best = uniform(all);
  for (const double sigma : rule.texture_sigmas_cells) {
    const auto smooth = [&](const Texture& t) { return smoothed(t, sigma); };
    const double e = error(smooth);
    if (e >= least) continue;
    least = e;
    best = smooth(all);
  }
  std::vector<double> blocks;
  for (std::size_t v = 0; v < images.size(); ++v) {
    if (!(gain[v] > 0.0)) continue;
    for (const double mean : block_means(images[v].power, rule.block_pixels)) blocks.push_back(mean / gain[v]);
  }
  const double usual = median(blocks), mean = weighted_mean(all);
  if (mean > 0.0)
    for (float& t : best.pixels()) t = static_cast<float>(double{t} * usual / mean);
  return best;
}

}  // namespace

// Plane, gains, texture and masks.

namespace {

/// Replaces each view's gain by the mean of its pitch. These means become the plane's gains.
void take_means_of_pitches(Views images, std::span<double> gain, LevelGround& plane) {
  std::vector<double> incidence_rad;
  for (const PosedImage& image : images) incidence_rad.push_back(image.acquisition.incidence_rad);
  plane.incidence_rad.clear();
  plane.gain.clear();
  for (const std::vector<std::size_t>& pitch : indices_by_pitch(incidence_rad)) {
    const auto n = static_cast<double>(pitch.size());
    double mean = 0.0, angle = 0.0;
    for (const std::size_t v : pitch) {
      mean += gain[v] / n;
      angle += incidence_rad[v] / n;
    }
    plane.incidence_rad.push_back(angle);
    plane.gain.push_back(mean);
    for (const std::size_t v : pitch) gain[v] = mean;
  }
}

/// Robust relative deviation of pixels from the plane's image.
double relative_deviation(Views images, const LevelGround& plane) {
  std::vector<std::vector<float>> of_view(images.size());
  for_each_view(images, [&](std::size_t v) {
    const Image<float> expected = ground_image(plane, images[v].acquisition);
    for (std::size_t n = 0; n < expected.pixels().size(); ++n) {
      const double e = double{expected.pixels()[n]};
      if (e > 0.0) of_view[v].push_back(static_cast<float>(std::abs(double{images[v].power.pixels()[n]} / e - 1.0)));
    }
  });
  std::vector<float> all;
  for (const std::vector<float>& deviations : of_view) all.insert(all.end(), deviations.begin(), deviations.end());
  return 1.48 * double{median(all)};
}

}  // namespace

std::optional<GroundEstimate> estimate_ground(Views images, const Box& box_m, std::optional<double> height_m,
                                              const GroundRule& rule) {
  if (images.size() < rule.least_views || !has_background(images)) return {};
  for (const PosedImage& image : images)
    if (block_means(image.power, rule.block_pixels).size() < rule.least_blocks) return {};
  GroundEstimate estimate;
  estimate.looks = looks_of(images);
  estimate.speckled = is_speckle(estimate.looks);
  UniformGround guess = uniform_ground(images, rule);
  std::vector<double>& gain = guess.gain;
  estimate.mask = std::move(guess.mask);
  if (!height_m && estimate.speckled) {
    const Evidence evidence = evidence_of(images, estimate.mask, rule);
    height_m = agreed_height_m(std::span(&evidence, 1), box_m, rule, true);
  }
  LevelGround plane = uniform_plane(images, box_m, height_m.value_or(box_m.min.y));
  take_means_of_pitches(images, gain, plane);
  for (int round = 0;; ++round) {
    for_each_view(images, [&](std::size_t v) {
      const Acquisition& a = images[v].acquisition;
      const Image<float> expected = ground_image(plane, a);
      estimate.mask[v] = ground_mask(images[v].power, expected, rule);
      // Gains use masked pixels only: the pixels that do not show the ground differ between views.
      const double seen = masked_sum(images[v].power, estimate.mask[v]), without = masked_sum(expected, estimate.mask[v]);
      gain[v] = plane.gain_at(a.incidence_rad) * (seen > 0.0 && without > 0.0 ? seen / without : 1.0);
    });
    if (round == rule.n_rounds) break;
    take_means_of_pitches(images, gain, plane);
    plane.texture = smoothed_texture(images, plane, gain, estimate.mask, rule);
  }
  estimate.deviation = relative_deviation(images, plane);
  if (estimate.part_of_pixels() < rule.least_ground_fraction) return {};
  if (!estimate.speckled && !(estimate.deviation < rule.most_deviation)) return {};
  if (estimate.speckled && rule.noise) plane.noise = noise_of_shadows(images, plane, estimate.mask, rule);
  estimate.plane = std::make_shared<const LevelGround>(std::move(plane));
  return estimate;
}

std::optional<double> common_ground_height_m(std::span<const std::vector<PosedImage>> scenes, const Box& box_m,
                                             const GroundRule& rule) {
  std::vector<Evidence> evidence;
  for (const std::vector<PosedImage>& images : scenes)
    if (images.size() > 1) evidence.push_back(evidence_of(images, uniform_ground(images, rule).mask, rule));
  return evidence.empty() ? std::nullopt : agreed_height_m(evidence, box_m, rule, false);
}

namespace {

bool shows_ground(const Mask& mask, const Acquisition& a, const RadarPoint& p) {
  const std::optional<glm::ivec2> at = pixel_of(a, p);
  return at && mask(at->x, at->y) != 0;
}

}  // namespace

BareViews bare_views(const GroundEstimate& ground, Views images, std::span<const RadarFrame> frames,
                     const glm::dvec3& point_m) {
  BareViews views;
  for (std::size_t v = 0; v < images.size(); ++v) {
    const Acquisition& a = images[v].acquisition;
    const RadarPoint p = project(a, frames[v], point_m);
    if (!pixel_of(a, p)) continue;
    ++views.n_seeing;
    const RadarFrame& frame = frames[v];
    const glm::dvec3 down = std::cos(p.ray_angle_rad) * frame.k + std::sin(p.ray_angle_rad) * frame.v;
    const RadarPoint foot = project(a, frame, point_m + down * ((ground.plane->height_m - point_m.y) / down.y));
    const Mask& mask = ground.mask[v];
    views.n_bare += shows_ground(mask, a, p) && (!pixel_of(a, foot) || shows_ground(mask, a, foot)) ? 1 : 0;
  }
  return views;
}

}  // namespace sarnerf
