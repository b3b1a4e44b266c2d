// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/image_file.h"
#include "sarnerf/evaluation/baseline.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/trainer.h"
#include "study.h"
#include "torch_setup.h"

namespace sarnerf::app {

std::string_view name(Arm arm) {
  switch (arm) {
    case Arm::none: return "none";
    case Arm::turned: return "turned";
    case Arm::turned_both: return "turned-both";
    case Arm::turned_circle: return "turned-360";
    case Arm::rescaled: return "rescaled";
    case Arm::interpolated: return "interpolated";
    case Arm::learned: return "learned";
    case Arm::learned_turned: return "learned+turned";
    case Arm::interpolated_turned: return "interpolated+turned";
    case Arm::corrected: return "corrected";
    case Arm::measured: return "measured";
  }
  return "";
}

namespace {

/// What the fields of a draw share.
struct FieldContext {
  std::uint64_t seed = 1;
  double ground_height_m = 0.0;  ///< above the aim point
};

/// A view to generate, the shot nearest to it, and the one on the other side of it.
struct WantedView {
  Acquisition acquisition;
  std::size_t nearest = 0, farther = 0;
};

/// Views that divide each gap between neighbouring shots evenly, in steps of about `step_deg`, without those that are farther from a shot
/// than the reach. At another depression than the shots', also at their azimuths.
std::vector<WantedView> wanted_views(std::span<const PosedImage> shots, const GenerationOptions& o, std::optional<double> depression_deg) {
  constexpr double kRounding_deg = 1e-9;
  std::vector<WantedView> views;
  for (std::size_t s = 0; s < shots.size(); ++s) {
    if (depression_deg) views.push_back({shots[s].acquisition, s, s});
    const std::size_t next = (s + 1) % shots.size();
    const double gap_deg = shots.size() == 1 ? 360.0 : std::fmod(azimuth_deg(shots[next]) - azimuth_deg(shots[s]) + 720.0, 360.0);
    const auto n_steps = std::lround(gap_deg / o.step_deg);
    for (long k = 1; k < n_steps; ++k) {
      const double from_deg = gap_deg * static_cast<double>(k) / static_cast<double>(n_steps);
      if (std::min(from_deg, gap_deg - from_deg) > o.reach_deg + kRounding_deg) continue;
      const std::size_t nearest = 2 * k <= n_steps ? s : next;
      WantedView& view = views.emplace_back(WantedView{shots[nearest].acquisition, nearest, nearest == s ? next : s});
      view.acquisition.azimuth_rad = shots[s].acquisition.azimuth_rad + rad_from_deg(from_deg);
    }
  }
  if (depression_deg)
    for (WantedView& view : views) view.acquisition.incidence_rad = rad_from_deg(90.0 - *depression_deg);
  return views;
}

/// A shot that is continued at its edges by its mirror image, as far as turning it to a view brings in what lies outside of it: a chip whose
/// corners are black would give its arm away.
PosedImage with_room(const PosedImage& shot, const Acquisition& wanted) {
  const Acquisition& a = shot.acquisition;
  const double turn_rad = apart_rad(a.azimuth_rad, wanted.azimuth_rad), c = std::abs(std::cos(turn_rad)), s = std::abs(std::sin(turn_rad));
  const double along_m = 0.5 * kStoredSide * a.azimuth_spacing_m;  // half of what is kept, on the level plane
  const double range_m = 0.5 * kStoredSide * a.range_spacing_m / std::sin(wanted.incidence_rad);
  const double rows = (along_m * c + range_m * s) / a.azimuth_spacing_m;
  const double bins = (along_m * s + range_m * c) * std::sin(a.incidence_rad) / a.range_spacing_m;
  const double missing = std::max(rows - 0.5 * a.n_azimuth, bins - 0.5 * a.n_range);
  if (missing <= 0.0) return shot;
  const int margin = static_cast<int>(std::ceil(missing)) + 1;
  PosedImage wide{shot.name, a, Image<float>(a.n_azimuth + 2 * margin, a.n_range + 2 * margin)};
  wide.acquisition.n_azimuth += 2 * margin;
  wide.acquisition.n_range += 2 * margin;
  const auto inside = [](int k, int n) {
    const int period = 2 * n, phase = ((k % period) + period) % period;
    return phase < n ? phase : period - 1 - phase;
  };
  for (int i = 0; i < wide.acquisition.n_azimuth; ++i)
    for (int j = 0; j < wide.acquisition.n_range; ++j)
      wide.power(i, j) = shot.power(inside(i - margin, a.n_azimuth), inside(j - margin, a.n_range));
  return wide;
}

PosedImage turned(const PosedImage& shot, const Acquisition& wanted) {
  const PosedImage wide = with_room(shot, wanted);
  return {shot.name, wanted, interpolate_view(std::span(&wide, 1), wanted, Interpolation::rotated_linear)};
}

/// Of the shots next to a view. Their depressions are nominal: shots of measured depressions, which differ by fractions of a degree, would
/// else count as neighbours of different pitches.
PosedImage interpolated(std::span<const PosedImage> shots, const Acquisition& wanted, Interpolation interpolation) {
  std::vector<PosedImage> wide;
  for (const PosedImage& shot : shots) {
    wide.push_back(with_room(shot, wanted));
    wide.back().acquisition.incidence_rad = shots.front().acquisition.incidence_rad;
  }
  return {"", wanted, interpolate_view(wide, wanted, interpolation)};
}

std::vector<PosedImage> turned_through_circle(std::span<const PosedImage> shots) {
  constexpr double kStep_deg = 15.0;
  std::vector<PosedImage> views;
  for (const PosedImage& shot : shots)
    for (double d = kStep_deg; d < 360.0; d += kStep_deg) {
      Acquisition wanted = shot.acquisition;
      wanted.azimuth_rad += rad_from_deg(d);
      views.push_back(turned(shot, wanted));
    }
  return views;
}

/// The box of a chip's swath about the aim point.
Box box_of(const Acquisition& a) {
  DatasetView view;
  view.incidence_deg = deg_from_rad(a.incidence_rad);
  view.slant_range_m = a.slant_range_m;
  view.n_azimuth = a.n_azimuth;
  view.n_range = a.n_range;
  view.azimuth_spacing_m = a.azimuth_spacing_m;
  view.range_spacing_m = a.range_spacing_m;
  return scene_box_of_swath(glm::dvec3(0.0), std::span(&view, 1));
}

/// Views of a field: means, without speckle. Each beside the field's view of the nearest shot, turned as the shot would be.
struct LearnedViews {
  std::vector<PosedImage> wanted, of_shots;
};

/// Of a field that is learned from the shots, which are too few to find the height of their ground.
LearnedViews learned_views(std::span<const PosedImage> shots, const std::vector<WantedView>& wanted, const GenerationOptions& o,
                           const FieldContext& context, const Monitor& monitor) {
  if (wanted.empty()) return {};
  use_torch_threads(1);
  GroundRule rule;
  rule.least_views = 2;
  rule.object_reach_pixels = kReachOfObject_pixels;
  TrainingSet set = training_set({shots.begin(), shots.end()}, box_of(shots.front().acquisition),
                                 {.ground_m = context.ground_height_m, .above_ground_m = {}}, {}, rule);
  TrainerOptions trainer_options = default_options(set, o.field);
  trainer_options.seed = context.seed;
  Trainer trainer(std::move(set), trainer_options, monitor);
  for (std::int64_t step = 0; step < o.field_steps; ++step) {
    monitor.check();
    trainer.step(static_cast<double>(step) / static_cast<double>(o.field_steps));
  }
  std::vector<PosedImage> at_shots;
  for (const PosedImage& shot : shots) at_shots.push_back({"", shot.acquisition, render_view(trainer.field(), shot.acquisition)});
  LearnedViews views;
  for (const WantedView& w : wanted) {
    monitor.check();
    views.wanted.push_back({"", w.acquisition, render_view(trainer.field(), w.acquisition)});
    views.of_shots.push_back(turned(at_shots[w.nearest], w.acquisition));
  }
  return views;
}

/// The measured chip nearest to a view in azimuth, of those that may be learned from: no test chip.
const PosedImage& nearest_chip(const ClassChips& chips, std::span<const std::size_t> test, const Acquisition& view) {
  const PosedImage* nearest = nullptr;
  double least_rad = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < chips.training.size(); ++n) {
    const double from_view_rad = apart_rad(chips.training[n].acquisition.azimuth_rad, view.azimuth_rad);
    if (from_view_rad >= least_rad || std::ranges::find(test, n) != test.end()) continue;
    least_rad = from_view_rad;
    nearest = &chips.training[n];
  }
  return *nearest;
}

/// The views of an arm that needs no field, from the shots of one class. `test`: those of its training chips that are tested.
std::vector<PosedImage> views_of(Arm arm, const ClassChips& chips, std::span<const PosedImage> shots, std::span<const std::size_t> test,
                                 const Options& o) {
  if (arm == Arm::turned_circle) return turned_through_circle(shots);
  const bool as_shots = arm == Arm::turned || arm == Arm::turned_both || arm == Arm::measured;
  const std::vector<WantedView> wanted = wanted_views(shots, o.generation, as_shots ? std::nullopt : o.generation.depression_deg);
  std::vector<PosedImage> views;
  for (const WantedView& w : wanted) {
    if (arm == Arm::turned || arm == Arm::turned_both || arm == Arm::rescaled) {
      views.push_back(turned(shots[w.nearest], w.acquisition));
      if (arm == Arm::turned_both) views.push_back(turned(shots[w.farther], w.acquisition));
    } else if (arm == Arm::interpolated) {
      views.push_back(interpolated(shots, w.acquisition, o.generation.interpolation));
    } else {
      views.push_back(nearest_chip(chips, test, w.acquisition));
    }
  }
  return views;
}

/// The shots of one class.
std::vector<PosedImage> shots_of(const ClassChips& chips, const std::vector<std::size_t>& which) {
  std::vector<PosedImage> shots;
  for (const std::size_t n : which) shots.push_back(chips.training[n]);
  return shots;
}

/// The height of the ground is estimated from the shots of all classes together; where they do not show it, the plane goes through the
/// aim point.
FieldContext field_context(const std::vector<ClassChips>& chips, const Draw& draw) {
  std::vector<std::vector<PosedImage>> scenes;
  for (std::size_t c = 0; c < chips.size(); ++c) scenes.push_back(shots_of(chips[c], draw.shots[c]));
  const Box box_m = box_of(scenes.front().front().acquisition);
  return {static_cast<std::uint64_t>(100'000 * draw.number + 1000 * draw.n_shots), common_ground_height_m(scenes, box_m).value_or(0.0)};
}

/// Views of all classes, one class after the other.
struct ViewsOfClasses {
  std::vector<PosedImage> views;
  std::vector<std::int64_t> labels;

  void add(std::vector<PosedImage> of_class, std::size_t c) {
    labels.insert(labels.end(), of_class.size(), static_cast<std::int64_t>(c));
    std::ranges::move(of_class, std::back_inserter(views));
  }

  LabelledChips chips() const {
    std::vector<const PosedImage*> pointers;
    for (const PosedImage& view : views) pointers.push_back(&view);
    return labelled(pointers, labels);
  }
};

/// The views of an arm that needs no field, of all classes.
LabelledChips views_of_classes(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& o, const Monitor& monitor) {
  ViewsOfClasses all;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    monitor.check();
    const std::span<const std::size_t> test = tests_training(chips[c], o.validate) ? std::span(draw.test[c]) : std::span<const std::size_t>();
    all.add(views_of(arm, chips[c], shots_of(chips[c], draw.shots[c]), test, o), c);
  }
  return all.chips();
}

/// Means that the fields of all classes predict: of the wanted views, and of the nearest shots, turned.
struct LearnedMeans {
  LabelledChips wanted, of_shots;
};

LearnedMeans learned_means(const std::vector<ClassChips>& chips, const Draw& draw, const Options& o, const Monitor& monitor) {
  const FieldContext shared = field_context(chips, draw);
  ViewsOfClasses wanted, of_shots;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    monitor.check();
    FieldContext context = shared;
    context.seed += c;
    const std::vector<PosedImage> shots = shots_of(chips[c], draw.shots[c]);
    LearnedViews views = learned_views(shots, wanted_views(shots, o.generation, o.generation.depression_deg), o.generation, context, monitor);
    wanted.add(std::move(views.wanted), c);
    of_shots.add(std::move(views.of_shots), c);
    monitor.report(format("fields of draw %d", draw.number), c + 1, chips.size());
  }
  return {wanted.chips(), of_shots.chips()};
}

/// The same from a file in `cache`, which is written if there is none of this study: fields take long.
LearnedMeans cached_means(const std::vector<ClassChips>& chips, const Draw& draw, const Options& o, const std::filesystem::path& cache,
                          const Monitor& monitor) {
  const auto file = cache / format("%02d_%02d.pt", draw.n_shots, draw.number);
  constexpr int kFormat = 2;  // of the file
  const std::string mark = Json{{"study", study_of(o, chips)}, {"format", kFormat}}.dump();
  if (std::filesystem::exists(file)) {
    const Archive archive = read_archive(file);
    const auto chips_of = [&](const char* amplitude) {
      return LabelledChips{archive.tensor(amplitude, torch::kFloat32, 3, file.string()), archive.tensor("label", torch::kInt64, 1, file.string()),
                           archive.tensor("pose_deg", torch::kFloat64, 2, file.string())};
    };
    if (archive.json == mark) return {chips_of("amplitude"), chips_of("of_shots")};
  }
  LearnedMeans means = learned_means(chips, draw, o, monitor);
  Archive archive;
  archive.json = mark;
  archive.tensors = {{"amplitude", means.wanted.amplitude}, {"of_shots", means.of_shots.amplitude}, {"label", means.wanted.label},
                     {"pose_deg", means.wanted.pose_deg}};
  write_archive(file, archive);
  return means;
}

}  // namespace

std::vector<Image<float>> powers_of(const LabelledChips& chips) {
  std::vector<Image<float>> powers;
  for (std::int64_t n = 0; n < chips.size(); ++n) {
    Image<float>& power = powers.emplace_back(kStoredSide, kStoredSide);
    const torch::Tensor squares = chips.amplitude[n].square().contiguous();
    std::copy_n(squares.data_ptr<float>(), power.pixels().size(), power.pixels().begin());
  }
  return powers;
}

namespace {

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

/// A view of mean power with clutter of mean 1, as amplitude. Texture that the field itself has on the background is left out: it would
/// count twice. Of target and shadow only the power up to the background's fluctuates (Rice 1944), with phases of its own.
void add_clutter(const Image<float>& power, const Image<float>& clutter, std::mt19937_64& random, float* amplitude) {
  const auto regions = find_regions(power);
  const double level = regions ? clutter_level(power, *regions) : std::numeric_limits<double>::infinity();
  std::uniform_real_distribution<double> phase(0.0, 2.0 * kPi);
  for (std::size_t p = 0; p < power.pixels().size(); ++p) {
    const bool is_background = regions && regions->background.pixels()[p] != 0;
    const double mean = is_background ? level : double{power.pixels()[p]}, fluctuating = std::min(mean, level);
    const double steady_amplitude = std::sqrt(mean - fluctuating), speckle_amplitude = std::sqrt(fluctuating * double{clutter.pixels()[p]});
    amplitude[p] = static_cast<float>(std::abs(std::polar(speckle_amplitude, phase(random)) + steady_amplitude));
  }
}

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

/// Means with the clutter that the options name.
LabelledChips with_clutter(const LabelledChips& means, const std::vector<ClassChips>& chips, const Draw& draw, const GenerationOptions& o) {
  if (o.speckle == Speckle::none) return means;
  const bool same_ground = o.speckle == Speckle::nearest_shot;
  std::vector<Image<float>> of_views;
  std::vector<std::vector<Image<float>>> of_classes;
  if (same_ground) {
    of_views = turned_backgrounds(chips, draw, o);
  } else {
    for (std::size_t c = 0; c < chips.size(); ++c) {
      ViewsOfClasses of_class;
      of_class.add(backgrounds_of_shots(chips[c], draw.shots[c]), c);
      of_classes.push_back(powers_of(of_class.chips()));
    }
  }
  std::mt19937_64 random(static_cast<std::uint64_t>(1'000'000 * (draw.number + 1)));
  const std::vector<Image<float>> powers = powers_of(means);
  LabelledChips result{torch::empty_like(means.amplitude), means.label, means.pose_deg};
  for (std::size_t n = 0; n < powers.size(); ++n) {
    const auto index = static_cast<std::int64_t>(n);
    const auto c = static_cast<std::size_t>(means.label[index].item<std::int64_t>());
    const Image<float> clutter = same_ground ? of_views[n] : random_background(of_classes[c], o.n_backgrounds, random);
    add_clutter(powers[n], clutter, random, result.amplitude[index].data_ptr<float>());
  }
  return result;
}

/// Turned shots, times the change from the turned shot to the wanted view that the fields predict: what of a shot no field follows (glints,
/// speckle) stays. Both means are raised by the field's expected error in the dark, a tenth of the view's clutter (m c in E8).
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

/// The arm whose chips stand beside turned ones in an arm that joins both.
std::optional<Arm> beside_turned(Arm arm) {
  if (arm == Arm::learned_turned) return Arm::learned;
  if (arm == Arm::interpolated_turned) return Arm::interpolated;
  return std::nullopt;
}

}  // namespace

LabelledChips generated_chips(Arm arm, const std::vector<ClassChips>& chips, const Draw& draw, const Options& o,
                              const std::filesystem::path& cache, const Monitor& monitor) {
  if (arm == Arm::none) return {};
  if (const std::optional<Arm> first = beside_turned(arm))
    return joined(generated_chips(*first, chips, draw, o, cache, monitor), generated_chips(Arm::turned, chips, draw, o, cache, monitor));
  if (arm == Arm::learned)  // means are cached, clutter is not
    return with_clutter(cached_means(chips, draw, o, cache, monitor).wanted, chips, draw, o.generation);
  if (arm == Arm::corrected) {
    const Arm same_views = o.generation.depression_deg ? Arm::rescaled : Arm::turned;
    return corrected(views_of_classes(same_views, chips, draw, o, monitor), cached_means(chips, draw, o, cache, monitor));
  }
  return views_of_classes(arm, chips, draw, o, monitor);
}

// Pictures.

Image<std::uint8_t> picture_of_rows(const std::vector<LabelledChips>& rows, std::optional<float> white) {
  constexpr int kColumns = 8, kGap_pixels = 2, kCell_pixels = kStoredSide + kGap_pixels;
  Image<std::uint8_t> picture(static_cast<int>(rows.size()) * kCell_pixels, kColumns * kCell_pixels, std::uint8_t{255});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::int64_t n = std::min<std::int64_t>(kColumns, rows[r].size());
    if (n == 0) continue;
    const torch::Tensor which = torch::floor_divide(torch::arange(n, torch::kInt64) * rows[r].size(), n);
    const std::vector<Image<float>> powers = powers_of({rows[r].amplitude.index_select(0, which), rows[r].label.index_select(0, which)});
    for (std::size_t column = 0; column < powers.size(); ++column) {
      const Image<std::uint8_t> levels =
          display_levels(powers[column], Quantity::power, white ? *white : white_level(powers[column]));
      for (int i = 0; i < kStoredSide; ++i)
        for (int j = 0; j < kStoredSide; ++j)
          picture(static_cast<int>(r) * kCell_pixels + i, static_cast<int>(column) * kCell_pixels + j) = levels(i, j);
    }
  }
  return picture;
}

std::vector<Image<std::uint8_t>> arms_pictures(const std::vector<ClassChips>& chips, const Draw& draw, const Options& o,
                                               const std::filesystem::path& cache, const Monitor& monitor) {
  std::vector<Arm> arms;  // joined ones as their parts
  for (const Arm arm : o.arms)
    for (const Arm part : {beside_turned(arm) ? Arm::turned : arm, beside_turned(arm).value_or(arm)})
      if (std::ranges::find(arms, part) == arms.end()) arms.push_back(part);
  Draw of_all_chips = draw;  // a picture may show test chips
  of_all_chips.test.assign(chips.size(), {});
  std::vector<LabelledChips> sets{generated_chips(Arm::measured, chips, of_all_chips, o, cache, monitor)};
  for (const Arm arm : arms)
    if (arm != Arm::none && arm != Arm::measured && arm != Arm::turned_circle && arm != Arm::turned_both)
      sets.push_back(generated_chips(arm, chips, draw, o, cache, monitor));
  std::vector<Image<std::uint8_t>> pictures;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    float white = 0.0f;
    for (const std::size_t n : draw.shots[c]) white = std::max(white, white_level(chips[c].training[n].power));
    std::vector<LabelledChips> rows;
    for (const LabelledChips& set : sets) {
      const torch::Tensor members = torch::nonzero(set.label == static_cast<std::int64_t>(c)).flatten();
      rows.push_back({set.amplitude.index_select(0, members), set.label.index_select(0, members)});
    }
    pictures.push_back(picture_of_rows(rows, white));
  }
  return pictures;
}

}  // namespace sarnerf::app
