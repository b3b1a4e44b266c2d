// SPDX-License-Identifier: Apache-2.0
// Three questions about the background of chips. Do classifiers recognise targets by it? Then they fail where it is exchanged. Do test chips show
// the ground that training chips show? Then their backgrounds are correlated. And is the background of generated chips like that of measured
// ones? Then a classifier cannot tell them apart.
#include "clutter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <random>
#include <utility>

#include "generation.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/formation/clutter.h"
#include "sarnerf/report/page.h"
#include "torch_setup.h"

namespace sarnerf::app {

// The exchange.

namespace {

/// Faint returns of a vehicle reach farther than the rule of regions finds it, and classifiers use them.
constexpr int kReachOfTarget_pixels = 8;

/// Pixels of target or shadow that are connected to those next to the centre, and up to kReachOfTarget_pixels around them. Others are speckle.
Image<std::uint8_t> target_and_shadow(const Image<float>& power) {
  Image<float> found(power.n_azimuth(), power.n_range());
  if (const std::optional<Regions> regions = find_regions(power)) {
    Image<std::uint8_t> other = regions->target;
    for (std::size_t n = 0; n < other.pixels().size(); ++n) other.pixels()[n] |= regions->shadow.pixels()[n];
    std::ranges::copy(connected_to_middle(other, kReachOfObject_pixels).pixels(), found.pixels().begin());
  }
  return target_mask(found, {.share_of_peak = 0.0, .dilation_pixels = kReachOfTarget_pixels});
}

/// The background of a chip. Where its target and its shadow are, that of the edge, half a chip away along both axes, or, where these hide that
/// too, along one.
Image<float> background_of(const Image<float>& power, const Image<std::uint8_t>& hidden) {
  Image<float> result = power;
  const int half_rows = power.n_azimuth() / 2, half_bins = power.n_range() / 2;
  const std::pair<int, int> moves[] = {{half_rows, half_bins}, {half_rows, 0}, {0, half_bins}};
  for (int i = 0; i < power.n_azimuth(); ++i)
    for (int j = 0; j < power.n_range(); ++j) {
      if (hidden(i, j) == 0) continue;
      for (const auto& [rows, bins] : moves) {
        const int from_i = (i + rows) % power.n_azimuth(), from_j = (j + bins) % power.n_range();
        result(i, j) = power(from_i, from_j);
        if (hidden(from_i, from_j) == 0) break;
      }
    }
  return result;
}

/// A chip whose background is exchanged.
struct TargetAndBackground {
  const Image<float>* power = nullptr;
  Image<std::uint8_t> kept;      ///< target and shadow
  double background_root = 1.0;  ///< mean square root of amplitude, which is what classifiers see, of the background
};

TargetAndBackground separated(const Image<float>& power) {
  TargetAndBackground result{&power, target_and_shadow(power)};
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t k = 0; k < power.pixels().size(); ++k) {
    if (result.kept.pixels()[k] != 0) continue;
    sum += std::pow(double{power.pixels()[k]}, 0.25);
    ++n;
  }
  if (sum > 0.0) result.background_root = sum / static_cast<double>(n);
  return result;
}

/// A chip whose pixels that are not kept are those of another background, times a gain.
Image<float> on_background(const Image<float>& power, const Image<std::uint8_t>& kept, const Image<float>& background, float gain) {
  Image<float> result = power;
  for (int i = 0; i < result.n_azimuth(); ++i)
    for (int j = 0; j < result.n_range(); ++j)
      if (kept(i, j) == 0) result(i, j) = gain * background(i, j);
  return result;
}

/// The target and the shadow of one chip on the background of another one, which is made as bright as the first one's.
Image<float> on_background_of(const TargetAndBackground& target, const TargetAndBackground& donor) {
  return on_background(*target.power, target.kept, background_of(*donor.power, donor.kept),
                       static_cast<float>(std::pow(target.background_root / donor.background_root, 4.0)));
}

/// Of each chip, one of another class, at random; or one of the four of its own class that are nearest in azimuth. A chip that is alone in
/// its class keeps its own background.
std::vector<std::size_t> donors(std::span<const PosedImage* const> chips, std::span<const std::int64_t> labels, bool within_class,
                                std::uint64_t seed) {
  constexpr std::size_t kNeighbours = 4;
  std::mt19937_64 random(seed);
  std::vector<std::size_t> donor(chips.size());
  for (std::size_t n = 0; n < donor.size(); ++n) {
    std::vector<std::size_t> possible;
    for (std::size_t m = 0; m < donor.size(); ++m)
      if (m != n && (labels[m] == labels[n]) == within_class) possible.push_back(m);
    if (within_class) {
      std::ranges::stable_sort(possible, {}, [&](std::size_t m) {
        return apart_rad(chips[m]->acquisition.azimuth_rad, chips[n]->acquisition.azimuth_rad);
      });
      possible.resize(std::min(possible.size(), kNeighbours));
    }
    donor[n] = possible.empty() ? n : possible[std::uniform_int_distribution<std::size_t>(0, possible.size() - 1)(random)];
  }
  return donor;
}

}  // namespace

Image<float> relative_background(const Image<float>& power) {
  Image<float> background = background_of(power, target_and_shadow(power));
  double sum = 0.0;
  for (const float p : background.pixels()) sum += double{p};
  const auto scale = static_cast<float>(static_cast<double>(background.pixels().size()) / std::max(sum, 1e-300));
  for (float& p : background.pixels()) p *= scale;
  return background;
}

Image<float> on_clutter(const Image<float>& power, const Image<float>& clutter) {
  const Image<std::uint8_t> kept = target_and_shadow(power);
  double sum = 0.0, n_others = 0.0;
  for (std::size_t p = 0; p < power.pixels().size(); ++p)
    if (kept.pixels()[p] == 0) sum += double{power.pixels()[p]}, n_others += 1.0;
  if (n_others == 0.0 || n_others == static_cast<double>(power.pixels().size())) return power;
  return on_background(power, kept, clutter, static_cast<float>(sum / n_others));
}

namespace {

/// Fills `within` and `across`.
void exchange_backgrounds(TestChips& test, const std::vector<ClassChips>& chips, const Draw& draw, bool validate) {
  // Within a class the new background is that of nearly the same azimuth: a class that was measured at one place at both depressions shows the
  // same ground again, and a classifier that knows it must not be taken for a fault of the exchange.
  std::vector<std::int64_t> labels;
  std::vector<const PosedImage*> originals;
  for (std::size_t c = 0; c < chips.size(); ++c)
    for (const std::size_t n : draw.test[c]) {
      originals.push_back(&list_of_test(chips[c], validate)[n]);
      labels.push_back(static_cast<std::int64_t>(c));
    }
  std::vector<TargetAndBackground> separate(originals.size());
  parallel_for(originals.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) separate[n] = separated(originals[n]->power);
  });
  const auto exchanged = [&](bool within_class) {
    const auto donor = donors(originals, labels, within_class, static_cast<std::uint64_t>(1000 * draw.n_shots + draw.number));
    std::vector<PosedImage> results(originals.size());
    parallel_for(originals.size(), 8, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t n = begin; n < end; ++n)
        results[n] = {originals[n]->name, originals[n]->acquisition, on_background_of(separate[n], separate[donor[n]])};
    });
    std::vector<const PosedImage*> pointers;
    for (const PosedImage& chip : results) pointers.push_back(&chip);
    return labelled(pointers, labels);
  };
  test.within = exchanged(true);
  test.across = exchanged(false);
}

// The same ground in training and test chips.

}  // namespace

TestChips test_of_classes(const std::vector<ClassChips>& chips, const Draw& draw, const Options& o) {
  TestChips test;
  test.measured = tested_chips(chips, draw, o.validate);
  if (o.exchange) exchange_backgrounds(test, chips, draw, o.validate);
  return test;
}

namespace {

/// The square root of amplitude, blurred so that speckle matters less than ground, and where target and shadow are.
struct GroundOfChip {
  double azimuth_rad = 0.0;
  Image<float> root;
  Image<std::uint8_t> hidden;
};

std::vector<GroundOfChip> ground_of(const std::vector<PosedImage>& chips) {
  constexpr double kBlur_pixels = 2.0;
  std::vector<GroundOfChip> ground(chips.size());
  parallel_for(chips.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      ground[n] = {chips[n].acquisition.azimuth_rad, gaussian_blur(chips[n].power, kBlur_pixels),
                   target_and_shadow(chips[n].power)};
      for (float& p : ground[n].root.pixels()) p = std::pow(p, 0.25f);
    }
  });
  return ground;
}

/// Correlation where both chips have background; empty if there is too little of it, or if it is constant.
std::optional<double> correlation(const GroundOfChip& a, const GroundOfChip& b) {
  constexpr double kLeast_pixels = 100.0;
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  for (std::size_t k = 0; k < a.root.pixels().size(); ++k) {
    if (a.hidden.pixels()[k] != 0 || b.hidden.pixels()[k] != 0) continue;
    const double p = double{a.root.pixels()[k]}, q = double{b.root.pixels()[k]};
    n += 1.0, x += p, y += q, xx += p * p, yy += q * q, xy += p * q;
  }
  const double variances = (xx - x * x / n) * (yy - y * y / n);
  if (n < kLeast_pixels || !(variances > 0.0)) return std::nullopt;
  return (xy - x * y / n) / std::sqrt(variances);
}

/// Mean correlation of test chips with the training chip that is nearest to their azimuth plus `offset_rad`.
class MeanCorrelation {
 public:
  void add(const std::vector<GroundOfChip>& test, const std::vector<GroundOfChip>& training, double offset_rad) {
    constexpr double kMost_rad = rad_from_deg(2.0);
    for (const GroundOfChip& chip : test) {
      const auto apart = [&](const GroundOfChip& other) { return apart_rad(other.azimuth_rad - chip.azimuth_rad, offset_rad); };
      const auto nearest = std::ranges::min_element(training, {}, apart);
      if (nearest == training.end() || apart(*nearest) > kMost_rad) continue;
      if (const auto c = correlation(chip, *nearest)) sum_ += *c, ++n_;
    }
  }
  void add(const MeanCorrelation& other) { sum_ += other.sum_, n_ += other.n_; }
  std::string text() const { return n_ > 0 ? format("%.3f", sum_ / n_) : "–"; }

 private:
  double sum_ = 0.0;
  int n_ = 0;
};

}  // namespace

std::string ground_text(const std::vector<ClassChips>& chips, const Monitor& monitor) {
  constexpr double kOffsets_deg[] = {0.0, 10.0, 90.0, 180.0};
  std::vector<std::vector<GroundOfChip>> training, test;
  for (const ClassChips& c : chips) {
    monitor.check();
    training.push_back(ground_of(c.training));
    test.push_back(ground_of(c.test));
    monitor.report("ground of classes", training.size(), chips.size());
  }
  std::vector<std::vector<std::string>> rows;
  MeanCorrelation all[std::size(kOffsets_deg)], all_others;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    monitor.check();
    if (test[c].empty()) continue;
    std::vector<std::string> row{chips[c].name};
    for (std::size_t k = 0; k < std::size(kOffsets_deg); ++k) {
      MeanCorrelation of_class;
      of_class.add(test[c], training[c], rad_from_deg(kOffsets_deg[k]));
      all[k].add(of_class);
      row.push_back(of_class.text());
    }
    MeanCorrelation others;
    for (std::size_t d = 0; d < chips.size(); ++d)
      if (d != c) others.add(test[c], training[d], 0.0);
    all_others.add(others);
    row.push_back(others.text());
    rows.push_back(row);
  }
  std::vector<std::string> row{"all"};
  for (const MeanCorrelation& mean : all) row.push_back(mean.text());
  row.push_back(all_others.text());
  rows.push_back(row);
  return "# Ground of test and of training chips\n\n"
         "Correlation of the background (square root of amplitude, blurred by 2 pixels, outside of target and shadow) of each test chip with that of a "
         "training chip, of its class at azimuths so far away (within 2 degrees), or of another class:\n\n" +
         markdown_table({{"class"}, {"same azimuth", Align::right}, {"10°", Align::right}, {"90°", Align::right}, {"180°", Align::right},
                         {"another class, same azimuth", Align::right}}, rows) +
         "\nWhere the first column is far from 0, test chips show ground that training chips show, and classifiers can recognise it.\n";
}

// Measured and generated background.

namespace {

/// The corners of the chips of every second class.
torch::Tensor corners_of_classes(const LabelledChips& chips, std::int64_t remainder) {
  const auto corners = corners_of(chips.amplitude.index_select(0, torch::nonzero(chips.label.remainder(2) == remainder).flatten()),
                                  crop_pixels(Classifier::texture));
  return torch::cat({corners.begin(), corners.end()});
}

/// Two kinds of patches, 0 and 1, as many of each.
LabelledChips two_kinds(const torch::Tensor& a, const torch::Tensor& b) {
  const std::int64_t n = std::min(a.size(0), b.size(0));
  return {torch::cat({a.narrow(0, 0, n), b.narrow(0, 0, n)}),
          torch::cat({torch::zeros({n}, torch::kInt64), torch::ones({n}, torch::kInt64)})};
}

struct ToldApart {
  double accuracy = 0.0;
  std::int64_t n_patches = 0;
};

/// How often a network that learned to tell the background of two kinds of chips apart, on every second class, does so on the others.
ToldApart told_apart(const LabelledChips& a, const LabelledChips& b, const ClassifierOptions& training, const Monitor& monitor) {
  ClassifierOptions options = training;
  options.shift_pixels = 0;
  // Patches are many and all different: the network need not be kept from learning them by heart.
  options.rate = 4e-3;
  options.label_smoothing = 0.0;
  const LabelledChips test = two_kinds(corners_of_classes(a, 1), corners_of_classes(b, 1));
  use_torch_threads(thread_count());
  const torch::Tensor scores = classify(Classifier::texture, {two_kinds(corners_of_classes(a, 0), corners_of_classes(b, 0)), {}}, test.amplitude, 2,
                                        options, [&](int done, int total) {
                                          monitor.check();
                                          monitor.report("telling backgrounds apart", static_cast<std::uint64_t>(done),
                                                         static_cast<std::uint64_t>(total));
                                        });
  return {(scores.argmax(1) == test.label).to(torch::kDouble).mean().item<double>(), test.size()};
}

/// What the background of two kinds of chips is compared in.
constexpr std::size_t kCompared = 1 + 2 * std::size_t{ClutterStatistics::kLags};
using BackgroundNumbers = std::array<double, kCompared>;

std::array<std::string, kCompared> names_of_background_numbers() {
  std::array<std::string, kCompared> names{"looks (mean² / variance)"};
  for (std::size_t lag = 1; lag <= ClutterStatistics::kLags; ++lag) {
    names[2 * lag - 1] = format("autocorrelation, %zu along track", lag);
    names[2 * lag] = format("autocorrelation, %zu in range", lag);
  }
  return names;
}

/// Of the background of each class.
std::vector<ClutterSums> sums_of_classes(const LabelledChips& chips, std::size_t n_classes, const Monitor& monitor) {
  const std::vector<Image<float>> powers = powers_of(chips);
  std::vector<std::vector<std::size_t>> members(n_classes);
  for (std::size_t n = 0; n < powers.size(); ++n) members[class_of(chips, n)].push_back(n);
  std::vector<ClutterSums> sums(n_classes);
  parallel_for(n_classes, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t c = begin; c < end; ++c)
      for (const std::size_t n : members[c]) {
        monitor.check();
        sums[c].add(powers[n], target_and_shadow(powers[n]));
      }
  });
  return sums;
}

/// Of all classes but one.
BackgroundNumbers background_numbers(const std::vector<ClutterSums>& of_classes, std::optional<std::size_t> without, const char* which) {
  ClutterSums sums;
  for (std::size_t c = 0; c < of_classes.size(); ++c)
    if (c != without) sums.add(of_classes[c]);
  const auto statistics = sums.statistics();
  if (!statistics) throw InputError(format("%s chips: expected a background around the target, found none", which));
  BackgroundNumbers numbers{statistics->looks};
  for (std::size_t lag = 1; lag <= ClutterStatistics::kLags; ++lag) {
    numbers[2 * lag - 1] = statistics->azimuth[lag - 1];
    numbers[2 * lag] = statistics->range[lag - 1];
  }
  return numbers;
}

/// Statistics of measured and of generated background, and the standard errors of their differences by the jackknife: each class is left out
/// once. Chips of one class share a ground, and learned views the clutter of a few shots, so that chips are no independent samples.
std::string table_of_backgrounds(const LabelledChips& measured, const LabelledChips& generated, std::size_t n_classes, const Monitor& monitor) {
  constexpr std::size_t kFewestClasses = 3;
  const auto a = sums_of_classes(measured, n_classes, monitor), b = sums_of_classes(generated, n_classes, monitor);
  const auto numbers_without = [&](std::optional<std::size_t> c) {
    return std::pair{background_numbers(a, c, "measured"), background_numbers(b, c, "generated")};
  };
  const auto [x, y] = numbers_without({});
  std::array<std::vector<double>, kCompared> differences;  // without one class
  for (std::size_t c = 0; n_classes >= kFewestClasses && c < n_classes; ++c) {
    const auto [p, q] = numbers_without(c);
    for (std::size_t k = 0; k < kCompared; ++k) differences[k].push_back(q[k] - p[k]);
  }
  const bool has_errors = !differences[0].empty();
  const auto names = names_of_background_numbers();
  std::vector<std::vector<std::string>> rows;
  for (std::size_t k = 0; k < kCompared; ++k)
    rows.push_back({names[k], format("%.4f", x[k]), format("%.4f", y[k]),
                    format("%+.4f", y[k] - x[k]) + (has_errors ? format(" ± %.4f", jackknife_error(differences[k])) : ""),
                    x[k] != 0.0 ? format("%+.1f %%", 100.0 * (y[k] - x[k]) / std::abs(x[k])) : "–"});
  return markdown_table({{"background"}, {"measured", Align::right}, {"generated", Align::right}, {"difference", Align::right}, {"of measured", Align::right}},
                        rows) +
         (has_errors ? "\n± one standard error: each class left out once (jackknife).\n" : "");
}

}  // namespace

std::string clutter_text(const Options& o, const std::vector<ClassChips>& chips, const Monitor& monitor) {
  const auto cache = o.output / "generated";
  make_folder(cache);
  const Draw draw = draw_shots(chips, *std::ranges::max_element(o.shots), 0, o);
  const LabelledChips measured = generated_chips(Arm::measured, chips, draw, o, cache, monitor);
  Options doubled = o;
  doubled.generation.n_backgrounds = 2;
  const LabelledChips learned = generated_chips(Arm::learned, chips, draw, o, cache, monitor),
                      learned_twice_the_looks = generated_chips(Arm::learned, chips, draw, doubled, cache, monitor);
  const ToldApart kinds = told_apart(measured, learned, o.training, monitor),
                  looks = told_apart(learned, learned_twice_the_looks, o.training, monitor);
  return format("# Background of measured and of generated chips\n\n%lld chips of either kind, %d shots of each class; outside of target and shadow, and %d pixels around them\n\n",
                static_cast<long long>(std::min(measured.size(), learned.size())), draw.n_shots, kReachOfTarget_pixels) +
         table_of_backgrounds(measured, learned, chips.size(), monitor) +
         format("\nA network that learned on every second class tells corners of 24 × 24 pixels of the others apart:\n"
                "measured from generated: %.1f %% of %lld (50 %% is chance)\n"
                "the looks of generated chips from twice as many: %.1f %% of %lld\n",
                100.0 * kinds.accuracy, static_cast<long long>(kinds.n_patches), 100.0 * looks.accuracy,
                static_cast<long long>(looks.n_patches));
}

}  // namespace sarnerf::app
