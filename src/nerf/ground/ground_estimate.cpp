// SPDX-License-Identifier: Apache-2.0
// Plane, gains, texture and masks of a level ground, estimated together.
#include <algorithm>
#include <cmath>

#include "ground_steps.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf::ground {

namespace {

// Texture.

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

// Plane and gains.

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

}  // namespace sarnerf::ground

namespace sarnerf {

double GroundEstimate::part_of_pixels() const {
  double n_ground = 0.0, n = 0.0;
  for (const Image<std::uint8_t>& m : mask) {
    n_ground += ground::masked_pixels(m);
    n += static_cast<double>(m.pixels().size());
  }
  return n > 0.0 ? n_ground / n : 0.0;
}

std::optional<GroundEstimate> estimate_ground(std::span<const PosedImage> images, const Box& box_m,
                                              std::optional<double> height_m, const GroundRule& rule) {
  using namespace ground;
  if (images.size() < rule.least_views || !has_background(images)) return {};
  for (const PosedImage& image : images)
    if (block_means(image.power, rule.block_pixels).size() < rule.least_blocks) return {};
  GroundEstimate estimate;
  estimate.looks = looks_of(images);
  estimate.speckled = is_speckle(estimate.looks);
  UniformGround guess = uniform_ground(images, rule);
  std::vector<double>& gain = guess.gain;
  estimate.mask = std::move(guess.mask);
  if (!height_m && estimate.speckled) height_m = agreed_height_m(images, estimate.mask, box_m, rule);
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

namespace {

bool shows_ground(const Image<std::uint8_t>& mask, const Acquisition& a, const RadarPoint& p) {
  const std::optional<glm::ivec2> at = pixel_of(a, p);
  return at && mask(at->x, at->y) != 0;
}

}  // namespace

BareViews bare_views(const GroundEstimate& ground, std::span<const PosedImage> images, std::span<const RadarFrame> frames,
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
    const Image<std::uint8_t>& mask = ground.mask[v];
    views.n_bare += shows_ground(mask, a, p) && (!pixel_of(a, foot) || shows_ground(mask, a, foot)) ? 1 : 0;
  }
  return views;
}

}  // namespace sarnerf
