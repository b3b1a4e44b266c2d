// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/training_set.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <ranges>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/dataset/posed_image.h"
#include "train/response.h"

namespace sarnerf {

double TrainingSet::finest_bin_m() const {
  double bin_m = std::numeric_limits<double>::infinity();
  for (const PosedImage& image : images) bin_m = std::min(bin_m, image.acquisition.range_spacing_m);
  return bin_m;
}

namespace {

float mean_of_brightest(const std::vector<PosedImage>& images) {
  std::vector<float> positive;
  for (const PosedImage& image : images)
    for (const float p : image.power.pixels())
      if (p > 0.0f) positive.push_back(p);
  if (positive.empty())
    throw InputError("deconvolution left no power in the images; is the resolution right?");
  const std::size_t n = std::max<std::size_t>(1, positive.size() / 100);
  std::nth_element(positive.begin(), positive.begin() + static_cast<std::ptrdiff_t>(n) - 1, positive.end(),
                   std::greater<>());
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) sum += double{positive[k]};
  return static_cast<float>(sum / static_cast<double>(n));
}

/// Height of objects whose shadows the images hold: in none does the shadow of a point above the aim point leave the swath. Nor is
/// it more than a fraction of the widest swath, in ground range.
double object_height_m(const std::vector<PosedImage>& images, double swath_fraction) {
  double swath_m = 0.0, shadow_m = std::numeric_limits<double>::infinity();
  for (const PosedImage& image : images) {
    const Acquisition& a = image.acquisition;
    const double in_ground_range_m = a.n_range * a.range_spacing_m / std::sin(a.incidence_rad);
    swath_m = std::max(swath_m, in_ground_range_m);
    shadow_m = std::min(shadow_m, 0.5 * in_ground_range_m / std::tan(a.incidence_rad));
  }
  return std::min(swath_fraction * swath_m, shadow_m);
}

/// Whether four fifths of the pixels are tails, below this level. Without a weighting window, sidelobes above −40 dB cover
/// more than a fifth of an image. Carving then removes too little: starting with opaque voxels in the rest was measured to fail.
bool is_mostly_tails(const std::vector<PosedImage>& images, float level) {
  std::size_t n_dark = 0, n = 0;
  for (const PosedImage& image : images) {
    n += image.power.pixels().size();
    for (const float p : image.power.pixels()) n_dark += p < level;
  }
  return 5 * n_dark > 4 * n;
}

std::vector<PosedImage> without_tails(std::vector<PosedImage> images, float level) {
  for (PosedImage& image : images)
    for (float& p : image.power.pixels())
      if (p < level) p = 0.0f;
  return images;
}

/// Whether all pixels hold the same power; false for images of one pixel each.
bool are_uniform(const std::vector<PosedImage>& images) {
  const float first = images.front().power.pixels().front();
  std::size_t n = 0;
  for (const PosedImage& image : images) {
    for (const float p : image.power.pixels())
      if (p != first) return false;
    n += image.power.pixels().size();
  }
  return n > images.size();
}

/// The ground that the images show. Its height is `height_m` (relative to the aim point), or estimated if that is not given.
std::optional<GroundEstimate> ground_of(const std::vector<PosedImage>& images, const Box& box_m, std::optional<double> height_m,
                                        const GroundRule& rule) {
  if (height_m && !(*height_m < box_m.max.y)) {
    throw UsageError(format("the ground lies %.3g m above the aim point, and the scene's box ends at %.3g m: nothing can stand "
                            "on it; give a lower height", *height_m, box_m.max.y));
  }
  return estimate_ground(images, box_m, height_m, rule);
}

}  // namespace

TrainingSet training_set(std::vector<PosedImage> images, const Box& scene_box_m, const SceneHeights& heights,
                         const std::optional<Resolution>& resolution, const GroundRule& ground_rule) {
  if (images.empty()) throw InputError("there is no image to learn from");
  TrainingSet set;
  const glm::dvec3 aim_m = images.front().acquisition.aim_m;
  set.box_m = set.whole_box_m = {scene_box_m.min - aim_m, scene_box_m.max - aim_m};
  set.outliers = limit_outliers(images);
  for (PosedImage& image : images) {
    image.acquisition.aim_m = glm::dvec3(0.0);
    for (const float p : image.power.pixels()) set.peak = std::max(set.peak, p);
  }
  if (!(set.peak > 0.0f))
    throw InputError("all pixels of the images to learn from are 0: there is nothing to learn; were they rendered "
                     "with another aim point than the dataset says?");
  if (are_uniform(images))
    throw InputError(format("all pixels of the images to learn from are equal (a power of %.4g): there is nothing to learn; do they "
                            "show the scene?", double{set.peak}));
  const std::optional<double> height_m = heights.ground_m ? std::optional(*heights.ground_m - aim_m.y) : std::nullopt;
  const bool speckled = is_speckled(images);
  set.ground_rule = ground_rule;
  set.images = std::move(images);
  const auto find_ground = [&] { set.ground = ground_of(set.training_images(), set.box_m, height_m, ground_rule); };
  if (speckled) find_ground();
  // Few speckled views may show a ground that cannot be estimated, and must not be deconvolved.
  if (!speckled || set.ground || set.images.size() >= ground_rule.least_views) set.resolution = resolution;
  if (set.resolution && !set.ground) set.deconvolved = richardson_lucy(set.images, *resolution);
  if (!set.ground && !(speckled && set.deconvolved.empty())) find_ground();
  set.bright = mean_of_brightest(set.training_images());
  if (set.ground) set.box_m.min.y = set.ground->plane->height_m;
  else if (height_m) set.box_m.min.y = *height_m;
  if (set.ground) {
    if (set.ground->speckled || heights.above_ground_m) {
      const double above_m = heights.above_ground_m.value_or(object_height_m(set.images, ground_rule.object_height_fraction));
      set.box_m.max.y = std::min(set.box_m.max.y, set.box_m.min.y + above_m);
    }
  } else if (const auto tail = static_cast<float>(ground_rule.tail_level) * set.peak;
             !set.resolution && has_background(set.images) && is_mostly_tails(set.images, tail)) {
    set.deconvolved = without_tails(set.images, tail);
    set.tails_are_dark = true;
  }
  set.background = has_background(set.training_images());
  return set;
}

TrainingSet images_alone(TrainingSet set) {
  set.ground.reset();
  set.box_m = set.whole_box_m;
  set.resolution.reset();
  set.deconvolved.clear();
  set.tails_are_dark = false;
  set.exact_poses = true;
  set.bright = mean_of_brightest(set.images);
  set.background = has_background(set.images);
  return set;
}

TrainingSet without_views(const TrainingSet& set, std::span<const std::size_t> views) {
  TrainingSet rest = set;
  const auto leave_out = [&](auto& of_views) {
    if (of_views.empty()) return;
    for (const std::size_t v : std::views::reverse(views)) of_views.erase(of_views.begin() + static_cast<std::ptrdiff_t>(v));
  };
  leave_out(rest.images);
  leave_out(rest.deconvolved);
  if (rest.ground) leave_out(rest.ground->mask);
  return rest;
}

}  // namespace sarnerf
