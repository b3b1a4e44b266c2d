// SPDX-License-Identifier: Apache-2.0
// The chips of each arm: views, and what they get beside their means.
#include "generation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "clutter.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/units.h"
#include "sarnerf/formation/clutter.h"

namespace sarnerf::app {

std::string_view name(Arm arm) {
  switch (arm) {
    case Arm::none: return "none";
    case Arm::turned: return "turned";
    case Arm::turned_both: return "turned-both";
    case Arm::turned_clutter: return "turned-clutter";
    case Arm::turned_circle: return "turned-360";
    case Arm::rescaled: return "rescaled";
    case Arm::interpolated: return "interpolated";
    case Arm::learned: return "learned";
    case Arm::learned_turned: return "learned+turned";
    case Arm::interpolated_turned: return "interpolated+turned";
    case Arm::turned_clutter_turned: return "turned-clutter+turned";
    case Arm::corrected: return "corrected";
    case Arm::measured: return "measured";
  }
  return "";
}

namespace {

// Clutter.

Image<float> mirrored(const Image<float>& image, bool along_track, bool in_range) {
  Image<float> result = image;
  for (int i = 0; i < image.n_azimuth(); ++i)
    for (int j = 0; j < image.n_range(); ++j)
      result(i, j) = image(along_track ? image.n_azimuth() - 1 - i : i, in_range ? image.n_range() - 1 - j : j);
  return result;
}

/// Mean power of a view's background.
double clutter_level(const Image<float>& power, const Regions& regions) {
  double sum = 0.0, n_pixels = 0.0;
  for (std::size_t p = 0; p < power.pixels().size(); ++p)
    if (regions.background.pixels()[p] != 0) sum += double{power.pixels()[p]}, n_pixels += 1.0;
  return n_pixels > 0.0 ? sum / n_pixels : regions.background_power;
}

/// A view of mean power, times clutter of mean 1 on its background, and times speckle of mean 1 on target and shadow, as amplitude. A field's mean is
/// smooth in azimuth, while scatterers interfere within a few degrees: a chip is one outcome of that. Texture that the field itself has on the
/// background is left out: it would count twice.
void add_clutter(const Image<float>& power, const Image<float>& clutter, const Image<float>& speckle, float* amplitude) {
  const auto regions = find_regions(power);
  const double level = regions ? clutter_level(power, *regions) : 0.0;
  for (std::size_t p = 0; p < power.pixels().size(); ++p) {
    const bool is_background = regions && regions->background.pixels()[p] != 0;
    amplitude[p] = static_cast<float>(std::sqrt(is_background ? level * double{clutter.pixels()[p]}
                                                              : double{power.pixels()[p]} * double{speckle.pixels()[p]}));
  }
}

/// Speckle with the looks and the width of response that the shots of all classes show together. Of one class, it would differ by the ground under
/// it, and clutter of its shots would repeat: targets of a class would have fluctuations in common, by which a classifier can know it.
class SpeckleOfShots {
 public:
  SpeckleOfShots(const std::vector<ClassChips>& chips, const Draw& draw) : acquisition_(chips.front().training.at(draw.shots.front().front()).acquisition) {
    acquisition_.n_azimuth = acquisition_.n_range = kStoredSide;
    // MSTAR's window: the shape of the response matters less than its width, which the clutter shows.
    if (const auto fitted = fitted_clutter(powers_of(shots_of_classes(chips, draw)), Window{Window::Kind::taylor}, acquisition_.azimuth_spacing_m,
                                           acquisition_.range_spacing_m))
      model_.radar = fitted->radar;  // without texture, which is that of the ground
  }

  /// 1 everywhere if the shots show no clutter.
  Image<float> sample(std::mt19937_64& random) {
    Image<float> speckle(kStoredSide, kStoredSide, 1.0f);
    model_.radar.seed = random();
    multiply_by_clutter(speckle, model_, acquisition_);
    return speckle;
  }

 private:
  Acquisition acquisition_;
  ClutterModel model_;
};

/// The backgrounds of a class's shots, relative to their means.
std::vector<PosedImage> backgrounds_of_shots(const ClassChips& chips, const std::vector<std::size_t>& which) {
  std::vector<PosedImage> backgrounds = shots_of(chips, which);
  for (PosedImage& shot : backgrounds) shot.power = relative_background(shot.power);
  return backgrounds;
}

/// The backgrounds of the nearest shots, turned to the wanted views of all classes.
std::vector<Image<float>> turned_backgrounds(const std::vector<ClassChips>& chips, const Draw& draw, const GenerationOptions& o) {
  ViewsOfClasses all;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    const std::vector<PosedImage> backgrounds = backgrounds_of_shots(chips[c], draw.shots[c]);
    std::vector<PosedImage> views;
    for (const WantedView& w : wanted_views(backgrounds, o, o.depression_deg)) views.push_back(turned(backgrounds[w.nearest], w.acquisition));
    all.add(std::move(views), c);
  }
  return powers_of(all.chips());
}

/// The mean of `n` backgrounds, chosen and mirrored at random.
Image<float> random_background(const std::vector<Image<float>>& backgrounds, int n, std::mt19937_64& random) {
  const auto up_to = [&](std::size_t end) { return std::uniform_int_distribution<std::size_t>(0, end - 1)(random); };
  Image<float> clutter(kStoredSide, kStoredSide);
  for (int k = 0; k < n; ++k) {
    const Image<float>& chosen = backgrounds[up_to(backgrounds.size())];
    const bool in_range = up_to(2) == 1, along_track = up_to(2) == 1;
    const Image<float> added = mirrored(chosen, along_track, in_range);
    for (std::size_t p = 0; p < added.pixels().size(); ++p) clutter.pixels()[p] += added.pixels()[p] / static_cast<float>(n);
  }
  return clutter;
}

/// The backgrounds of the shots of all classes, over their means.
std::vector<std::vector<Image<float>>> backgrounds_of_classes(const std::vector<ClassChips>& chips, const Draw& draw) {
  std::vector<std::vector<Image<float>>> of_classes;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    ViewsOfClasses of_class;
    of_class.add(backgrounds_of_shots(chips[c], draw.shots[c]), c);
    of_classes.push_back(powers_of(of_class.chips()));
  }
  return of_classes;
}

/// Of the clutter of a draw's views.
std::mt19937_64 random_of_clutter(const Draw& draw) { return std::mt19937_64(static_cast<std::uint64_t>(1'000'000 * (draw.number + 1))); }

/// Turned shots on the clutter that learned views get.
LabelledChips on_clutter_of_shots(const LabelledChips& turned_shots, const std::vector<ClassChips>& chips, const Draw& draw) {
  const auto of_classes = backgrounds_of_classes(chips, draw);
  std::mt19937_64 random = random_of_clutter(draw);
  const std::vector<Image<float>> powers = powers_of(turned_shots);
  LabelledChips result{torch::empty_like(turned_shots.amplitude), turned_shots.label, turned_shots.pose_deg};
  for (std::size_t n = 0; n < powers.size(); ++n) {
    const Image<float> power = on_clutter(powers[n], random_background(of_classes[class_of(turned_shots, n)], 1, random));
    float* amplitude = result.amplitude[static_cast<std::int64_t>(n)].data_ptr<float>();
    std::ranges::transform(power.pixels(), amplitude, [](float p) { return std::sqrt(p); });
  }
  return result;
}

/// Means with the clutter that the options name.
LabelledChips with_clutter(const LabelledChips& means, const std::vector<ClassChips>& chips, const Draw& draw, const GenerationOptions& o) {
  if (o.speckle == Speckle::none) return means;
  const bool same_ground = o.speckle == Speckle::nearest_shot;
  std::vector<Image<float>> of_views;
  std::vector<std::vector<Image<float>>> of_classes;
  if (same_ground) of_views = turned_backgrounds(chips, draw, o);
  else of_classes = backgrounds_of_classes(chips, draw);
  SpeckleOfShots speckle(chips, draw);
  std::mt19937_64 random = random_of_clutter(draw), random_of_speckle(random_of_clutter(draw)());
  const std::vector<Image<float>> powers = powers_of(means);
  LabelledChips result{torch::empty_like(means.amplitude), means.label, means.pose_deg};
  for (std::size_t n = 0; n < powers.size(); ++n) {
    const auto index = static_cast<std::int64_t>(n);
    const Image<float> clutter = same_ground ? of_views[n] : random_background(of_classes[class_of(means, n)], o.n_backgrounds, random);
    add_clutter(powers[n], clutter, speckle.sample(random_of_speckle), result.amplitude[index].data_ptr<float>());
  }
  return result;
}

/// Turned shots, times the change from the turned shot to the wanted view that the fields predict: what of a shot no field follows (glints,
/// speckle) stays. Both means are raised by the field's expected error in the dark, a tenth of the view's clutter (m c in E8 of docs/method/equations.md).
LabelledChips corrected(const LabelledChips& turned_shots, const LearnedMeans& means) {
  constexpr double kError_clutter = 0.1;
  LabelledChips result{torch::empty_like(turned_shots.amplitude), turned_shots.label, turned_shots.pose_deg};
  const std::vector<Image<float>> wanted = powers_of(means.wanted);
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    const auto index = static_cast<std::int64_t>(n);
    const auto regions = find_regions(wanted[n]);
    const torch::Tensor to = means.wanted.amplitude[index].square(), from = means.of_shots.amplitude[index].square();
    const double error = kError_clutter * (regions ? regions->background_power : to.mean().item<double>());
    result.amplitude[index] = turned_shots.amplitude[index] * ((to + error) / (from + error).clamp_min(1e-30)).sqrt();
  }
  return result;
}

}  // namespace

std::size_t most_generated(Arm arm, const Draw& draw, const GenerationOptions& o) {
  if (arm == Arm::none) return 0;
  if (const std::optional<Arm> first = beside_turned(arm)) return most_generated(*first, draw, o) + most_generated(Arm::turned, draw, o);
  std::size_t n = 0;
  for (const auto& shots : draw.shots) {
    const auto views = static_cast<std::size_t>(360.0 / o.step_deg) + 1 + 2 * shots.size();  // steps are rounded, and shots may have views
    n += arm == Arm::turned_circle ? static_cast<std::size_t>(kTurnsOfCircle - 1) * shots.size() : arm == Arm::turned_both ? 2 * views : views;
  }
  return n;
}

LabelledChips generated_chips(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& o,
                              const std::filesystem::path& cache, const Monitor& monitor) {
  if (arm == Arm::none) return {};
  if (const std::optional<Arm> first = beside_turned(arm))
    return joined(generated_chips(*first, chips, draw, o, cache, monitor), generated_chips(Arm::turned, chips, draw, o, cache, monitor));
  if (arm == Arm::learned)  // means are cached, clutter is not
    return with_clutter(learned_means(chips, draw, o, cache, monitor).wanted, chips, draw, o.generation);
  if (arm == Arm::corrected) {
    const Arm same_views = o.generation.depression_deg ? Arm::rescaled : Arm::turned;
    return corrected(views_of_classes(same_views, chips, draw, o, monitor), learned_means(chips, draw, o, cache, monitor));
  }
  if (arm == Arm::turned_clutter) return on_clutter_of_shots(views_of_classes(Arm::turned, chips, draw, o, monitor), chips, draw);
  return views_of_classes(arm, chips, draw, o, monitor);
}

}  // namespace sarnerf::app
