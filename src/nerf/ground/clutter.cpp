// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "ground/median_ground.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

namespace {

using Views = std::span<const PosedImage>;

/// Rounds of telling what looks like ground, and the ground's texture from that.
constexpr int kRounds = 4;

/// Of pixels from the median ground, where images are not speckled: relief, hedges and the like deviate more.
constexpr double kMostDeviation = 0.2;

/// Standard deviations (cells) of smoothing that are tried; beyond the last, the ground is uniform.
constexpr double kSmoothings[] = {1.0, 2.0, 4.0, 8.0, 16.0};

/// Pixels count as ground where their surroundings, of so many pixels' standard deviation, are between half and twice as bright.
constexpr double kSurroundings = 1.5, kAlike = 2.0;

/// Of all pixels, that look like ground: less is no ground, but what falls off around an object, its speckled sidelobes.
constexpr double kLeastShare = 0.25;

/// Incidences that differ less belong to one pitch (0.25°).
constexpr double kOnePitch_rad = 0.0043633;

/// Mean of what views see of each cell where their surroundings look like ground, and how many those views are.
struct Texture {
  Image<float> mean, n_views;
};

Texture texture_of(Views images, const MedianGround& ground, std::span<const Image<std::uint8_t>> like, std::size_t first,
                   std::size_t step) {
  std::vector<RadarFrame> frames;
  for (const PosedImage& image : images) frames.push_back(radar_frame(image.acquisition));
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
          const RadarPoint p = project(a, frames[v], point_m);
          const std::optional<glm::ivec2> at = pixel_of(a, p);
          if (!at || like[v](at->x, at->y) == 0 || !(ground.gain[v] > 0.0)) continue;
          sum += double{images[v].power(at->x, at->y)} / ground.gain[v];
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

/// Mean brightness of the ground over its gain, by the median of means over squares of pixels: most of them hold nothing
/// else, and their mean is not darkened by speckle as single pixels' median is.
double usual_mean(Views images, const MedianGround& ground) {
  constexpr int kSquare = 12;
  std::vector<double> means;
  for (std::size_t v = 0; v < images.size(); ++v) {
    const Image<float>& power = images[v].power;
    if (!(ground.gain[v] > 0.0)) continue;
    for (int i = 0; i + kSquare <= power.n_azimuth(); i += kSquare)
      for (int j = 0; j + kSquare <= power.n_range(); j += kSquare) {
        double sum = 0.0;
        for (int n = 0; n < kSquare * kSquare; ++n) sum += double{power(i + n / kSquare, j + n % kSquare)};
        means.push_back(sum / (kSquare * kSquare) / ground.gain[v]);
      }
  }
  return median(means);
}

double square_of_difference(const Image<float>& a, const Image<float>& b, const Image<float>& weight) {
  double sum = 0.0;
  for (std::size_t n = 0; n < weight.pixels().size(); ++n) {
    const double d = double{a.pixels()[n]} - double{b.pixels()[n]};
    sum += double{weight.pixels()[n]} * d * d;
  }
  return sum;
}

Image<float> uniform(const Image<float>& like, double value) {
  return Image<float>(like.n_azimuth(), like.n_range(), static_cast<float>(value));
}

/// Blurred, pixels counting as often as they were seen; `otherwise` where nothing was for three standard deviations.
Image<float> smoothed(const Texture& texture, double sigma, double otherwise) {
  Image<float> seen = texture.mean;
  for (std::size_t n = 0; n < seen.pixels().size(); ++n) seen.pixels()[n] *= texture.n_views.pixels()[n];
  seen = gaussian_blur(seen, sigma);
  const Image<float> weight = gaussian_blur(texture.n_views, sigma);
  for (std::size_t n = 0; n < seen.pixels().size(); ++n) {
    const float w = weight.pixels()[n];
    seen.pixels()[n] = w > 0.0f ? seen.pixels()[n] / w : static_cast<float>(otherwise);
  }
  return seen;
}

/// The texture, smoothed as half of the views predict the other half best.
///
/// Its mean is made the usual one: looking like ground is a choice, and pixels that happen to be bright do so less often.
Image<float> smoothed_texture(Views images, const MedianGround& ground, std::span<const Image<std::uint8_t>> like,
                              double usual) {
  const Texture all = texture_of(images, ground, like, 0, 1), even = texture_of(images, ground, like, 0, 2),
                odd = texture_of(images, ground, like, 1, 2);
  const auto error = [&](auto&& smooth) {
    return square_of_difference(smooth(even), odd.mean, odd.n_views) +
           square_of_difference(smooth(odd), even.mean, even.n_views);
  };
  const auto uniformly = [](const Texture& t) { return uniform(t.mean, weighted_mean(t)); };
  double least = error(uniformly);
  Image<float> best = uniformly(all);
  for (const double sigma : kSmoothings) {
    const auto smoothly = [&](const Texture& t) { return smoothed(t, sigma, weighted_mean(t)); };
    const double e = error(smoothly);
    if (e >= least) continue;
    least = e;
    best = smoothly(all);
  }
  const double mean = weighted_mean(all);
  if (mean > 0.0)
    for (float& t : best.pixels()) t = static_cast<float>(double{t} * usual / mean);
  return best;
}

Image<std::uint8_t> pixels_like(const PosedImage& image, const LevelGround& ground, double gain) {
  Image<float> ratio(image.power.n_azimuth(), image.power.n_range());
  for (int i = 0; i < ratio.n_azimuth(); ++i) {
    const GroundBins bins = ground_bins(ground, image.acquisition, i);
    for (int j = 0; j < ratio.n_range(); ++j) {
      const double expected = gain * double{bins.power[static_cast<std::size_t>(j)]};
      ratio(i, j) = expected > 0.0 ? static_cast<float>(double{image.power(i, j)} / expected) : 0.0f;
    }
  }
  const Image<float> around = gaussian_blur(ratio, kSurroundings);
  Image<std::uint8_t> like(ratio.n_azimuth(), ratio.n_range());
  for (std::size_t n = 0; n < like.pixels().size(); ++n)
    like.pixels()[n] = double{around.pixels()[n]} > 1.0 / kAlike && double{around.pixels()[n]} < kAlike ? 1 : 0;
  return like;
}

/// Mean power of a view over the ground's, of the pixels that look like ground; the gain so far where none do.
///
/// Shadows, and what shines, are other shares of each view: a median of all pixels mistakes them for gain, by a quarter
/// where a building's walls and shadow turn with the view.
double gain_over_ground(const PosedImage& image, const LevelGround& ground, const Image<std::uint8_t>& like,
                        double gain) {
  double seen = 0.0, expected = 0.0;
  for (int i = 0; i < like.n_azimuth(); ++i) {
    const GroundBins bins = ground_bins(ground, image.acquisition, i);
    for (int j = 0; j < like.n_range(); ++j) {
      if (like(i, j) == 0) continue;
      seen += double{image.power(i, j)};
      expected += double{bins.power[static_cast<std::size_t>(j)]};
    }
  }
  return seen > 0.0 && expected > 0.0 ? seen / expected : gain;
}

double share_of(std::span<const Image<std::uint8_t>> like) {
  std::size_t n_like = 0, n = 0;
  for (const Image<std::uint8_t>& image : like) {
    n += image.pixels().size();
    for (const std::uint8_t l : image.pixels()) n_like += l;
  }
  return n > 0 ? static_cast<double>(n_like) / static_cast<double>(n) : 0.0;
}

/// Mean gain of each pitch goes to the ground, what is left of a view's gain stays with the view.
void share_gains(Views images, std::span<const double> gain, LevelGround& ground, std::vector<double>& of_view) {
  std::vector<std::size_t> order(images.size());
  for (std::size_t v = 0; v < order.size(); ++v) order[v] = v;
  const auto incidence = [&](std::size_t v) { return images[v].acquisition.incidence_rad; };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return incidence(a) < incidence(b); });
  of_view.assign(images.size(), 1.0);
  ground.incidence_rad.clear();
  ground.gain.clear();
  for (std::size_t first = 0; first < order.size();) {
    std::size_t end = first + 1;
    while (end < order.size() && incidence(order[end]) - incidence(order[end - 1]) < kOnePitch_rad) ++end;
    double sum = 0.0, angle = 0.0;
    for (std::size_t n = first; n < end; ++n) sum += gain[order[n]], angle += incidence(order[n]);
    const double mean = sum / static_cast<double>(end - first);
    ground.incidence_rad.push_back(angle / static_cast<double>(end - first));
    ground.gain.push_back(mean);
    for (std::size_t n = first; n < end; ++n) of_view[order[n]] = mean > 0.0 ? gain[order[n]] / mean : 1.0;
    first = end;
  }
}

}  // namespace

std::optional<Clutter> find_clutter(Views images, const Box& box_m) {
  std::optional<MedianGround> found = median_ground(images, box_m);
  if (!found) return {};
  const bool speckled = is_speckled(images);
  if (!speckled && !(found->deviation < kMostDeviation)) return {};
  auto ground = std::make_shared<LevelGround>();
  ground->height_m = found->height_m;
  ground->cell_m = found->cell_m;
  ground->first_x_m = found->first_x_m;
  ground->first_z_m = found->first_z_m;
  Clutter clutter;
  clutter.deviation = found->deviation;
  clutter.speckled = speckled;
  share_gains(images, found->gain, *ground, clutter.gain);
  // The usual brightness tells first what looks like ground; gains and the texture of that then tell better.
  double usual = usual_mean(images, *found);
  ground->texture = uniform(found->texture, usual);
  clutter.like_ground.assign(images.size(), {});
  for (int round = 0; round < kRounds; ++round) {
    parallel_for(images.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t v = begin; v < end; ++v) {
        clutter.like_ground[v] = pixels_like(images[v], *ground, clutter.gain[v]);
        found->gain[v] = ground->gain_at(images[v].acquisition.incidence_rad) *
                         gain_over_ground(images[v], *ground, clutter.like_ground[v], clutter.gain[v]);
      }
    });
    if (round + 1 == kRounds) break;
    share_gains(images, found->gain, *ground, clutter.gain);
    usual = usual_mean(images, *found);
    ground->texture = smoothed_texture(images, *found, clutter.like_ground, usual);
  }
  if (share_of(clutter.like_ground) < kLeastShare) return {};
  clutter.ground = std::move(ground);
  return clutter;
}

}  // namespace sarnerf
