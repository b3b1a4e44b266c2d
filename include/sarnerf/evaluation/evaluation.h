// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/baseline.h"

/// Scores of images with a background, beside PSNR. PSNR is dominated by bright scatterers and saturated by speckle
/// (docs/guide/metrics.md).
namespace sarnerf {

struct BackgroundRule {
  double range_db = 40.0;      ///< range of log amplitudes, below the peak
  RegionRule regions{};        ///< of target and shadow, in truth and prediction
  LooksRule looks{};           ///< looks are estimated where the truth has neither
  int n_scatterers = 5;        ///< number of strongest scatterers
  double separation_m = 1.0;   ///< least distance between them
};

/// Scores of one image, or their means over the views that have a value. Looks have the harmonic mean, which averages
/// 1/looks (the relative variance); all other scores the arithmetic mean. All finite.
struct BackgroundScores {
  double log_amplitude_error_db = 0.0;  ///< log_amplitude_error_db()
  double log_amplitude_psnr_db = 0.0;   ///< 20 log₁₀(range / that error), kMostPsnr_db at the most
  std::optional<double> looks, looks_of_truth;  ///< equivalent_looks(); none where there is too little background
  std::optional<double> target_iou, shadow_iou;  ///< none where neither image has such a region
  /// Mean distance of the truth's strongest scatterers to the nearest of as many of the prediction's; none where the
  /// truth has no pixel as bright as a target.
  std::optional<double> scatterer_error_m;
};

/// Scores a power image. Regions of the prediction follow the same rule, relative to its own background, so that a gain
/// factor changes no region; without a background it has no regions, and no overlap. For a prediction without local
/// maxima, the scatterer error is the image's diagonal. Throws UsageError when sizes differ or the peak is not
/// positive. Cost: a blur, and some 10 passes over the image.
BackgroundScores score_background(const Image<float>& power, const PosedImage& truth, double peak,
                                  const BackgroundRule& rule = {});

/// Throws UsageError without views.
BackgroundScores mean_of(std::span<const BackgroundScores> views);

}  // namespace sarnerf

/// Scores of images of unseen views, beside those of interpolation between the training images on the same views.
namespace sarnerf {

/// PSNR after the best shift of a prediction: an upper bound for what a better geometry can reach, since the truth chooses
/// the shift.
struct RegisteredScores {
  double psnr_power_db = 0.0, psnr_amplitude_db = 0.0;
};

/// Scores a prediction after one shift of at most two pixels along each axis, without a gain. The shift has the least squared
/// error of amplitude over the even blocks of 16 x 16 pixels (a chessboard); it is found by whole pixels, then by Gauss-Newton
/// steps. The scores are those of the odd blocks. Power is interpolated by Lanczos' kernel of eight taps, which keeps the
/// band; the border is repeated. Throws UsageError when sizes differ, the peak is not positive or the image has no odd
/// block. Cost: 25 comparisons at whole-pixel and 6 at interpolated shifts.
RegisteredScores score_registered(const Image<float>& power, const PosedImage& truth, double peak);

/// Scores of one image, or their means over views. All finite.
struct Scores {
  double psnr_power_db = 0.0;      ///< of linear power
  double psnr_amplitude_db = 0.0;  ///< of its square root
  /// PSNR of power over the dilated target; none where the truth is blank.
  std::optional<double> psnr_target_power_db;
  double ssim_power = 0.0;
  std::optional<double> lpips;  ///< none unless requested
  std::optional<BackgroundScores> background;  ///< none if the truth has no visible background
  std::optional<RegisteredScores> registered;  ///< none unless requested
};

/// One method of predicting images, scored on all views.
struct MethodScores {
  std::string name;
  std::vector<Scores> views;  ///< in the order of the truth
  Scores mean;                ///< decibels averaged as such, over the views that have a value
  int n_capped = 0;           ///< views whose PSNR of power is kMostPsnr_db
};

/// The view that a row of scores belongs to.
struct EvaluatedView {
  std::string name;
  double azimuth_rad = 0.0;
  double incidence_rad = 0.0;
};

struct Evaluation {
  double peak_power = 0.0;  ///< reference of all PSNR and SSIM; its square root for amplitudes
  TargetRule target;
  std::vector<EvaluatedView> views;
  std::optional<MethodScores> prediction;  ///< none if only the baselines were scored
  std::vector<MethodScores> baselines;     ///< none without training images
  std::vector<MethodScores> bounds;        ///< scores of EvaluationSettings::bounds
  std::optional<BackgroundRule> background;  ///< rule of the background scores; none if there are none

  /// The baseline with the highest mean PSNR of power; null where there is none.
  const MethodScores* best_baseline() const;

  /// The prediction's mean PSNR of power minus the best baseline's (dB): the gain of a learned field. None where either
  /// is missing.
  std::optional<double> margin_db() const;
};

/// A distance between two power images relative to a peak, smaller for more alike ones (nerf/lpips.h has one). Called
/// by the thread that called evaluate(), never inside a parallel loop.
using ImageDistance =
    std::function<double(const Image<float>& power, const Image<float>& truth, double peak)>;

/// Images to be scored beside the prediction, made from data that no method may use, such as other views of the truth.
struct Bound {
  std::string name;
  std::vector<Image<float>> images;  ///< one a view
};

struct EvaluationSettings {
  std::optional<double> peak_power;  ///< unless given, peak_power() of the training images
  TargetRule target;
  std::optional<std::vector<Baseline>> baselines;  ///< unless given, default_baselines()
  ImageDistance lpips;                             ///< empty: not computed
  std::vector<Bound> bounds;
  bool oracle_registered = false;  ///< also score_registered() every image
  BackgroundRule background;  ///< used where the truth has_visible_background()
};

/// Largest power of all images. Throws InputError when they are blank or there are none: then PSNR has no reference.
double peak_power(std::span<const PosedImage> images);

/// Scores of one image, relative to a peak. Throws UsageError when sizes differ or the peak is not positive;
/// NumericsError, naming the view, for an image with values that are not finite. Powers below zero, which a
/// method may predict, have amplitude zero. Without LPIPS and score_background().
Scores score_view(const Image<float>& power, const PosedImage& truth, double peak,
                  const TargetRule& target = {});

/// Scores predictions of the views in `truth`, and each baseline and bound on the same views. `predictions` are linear power
/// on the grids of the truth, one a view, or none at all; without `training` there are no baselines and the
/// settings must name the peak. Throws UsageError when counts or sizes do not fit or there is no view, NumericsError
/// for predictions that are not finite, InputError for blank training images, Interrupted when the monitor asks
/// for it. Views are scored in parallel, with the same result for any number of threads; LPIPS runs view after view.
/// Memory: one image a thread.
Evaluation evaluate(std::span<const PosedImage> truth, std::span<const Image<float>> predictions,
                    std::span<const PosedImage> training, const EvaluationSettings& settings = {},
                    const Monitor& monitor = {});

}  // namespace sarnerf

namespace sarnerf {

/// Measured views averaged with their neighbours: a truth with less speckle, where none without speckle exists.
struct DespeckledTruth {
  std::vector<std::size_t> which;  ///< indices of these views among those that the truth was made of
  std::vector<PosedImage> views;  ///< the truth, each named and posed as the view in its middle
  /// For each view, the mean of other views about it: an estimate as good as the truth itself and independent of it. A
  /// prediction that is as close to the truth as this mean is as good as a measurement.
  std::vector<Image<float>> true_neighbours;
};

/// Splits views that were not trained on, pitch by pitch (see Interpolation), into the first, third, fifth … (odd) and the
/// second, fourth, … (even) in the order of azimuth. The truth of an odd view is the mean power of the odd views within
/// `reach_rad` of it in azimuth. Each is turned to its azimuth and incidence as by rotated_linear, by the level plane
/// through the aim point: over a few degrees the plane's height matters little. The true neighbours are the same mean of
/// the even views. Odd views without another odd one or without an even one within reach are left out.
///
/// At intervals of a degree, a reach of 3° has two or three views each. So the truth keeps some speckle, and no method can
/// come as close to it as to a clean truth.
///
/// Throws UsageError for a reach that is not in (0, π), and as interpolate_view() for the views. Cost: a turned image
/// for each view within reach.
DespeckledTruth despeckled_truth(std::span<const PosedImage> unseen, double reach_rad);

/// evaluate() on a despeckled truth, with two bounds: its true neighbours, and those blurred (σ of one pixel).
/// `predictions` are those of all views that the truth was made of, in their order, or none. The settings' own bounds
/// must have one image for each of the truth's views. Throws and costs as evaluate().
Evaluation evaluate_despeckled(const DespeckledTruth& truth,
                               std::span<const Image<float>> predictions,
                               std::span<const PosedImage> training, EvaluationSettings settings = {},
                               const Monitor& monitor = {});

}  // namespace sarnerf

/// Statistics of studies in which two methods are compared on the same draws.
namespace sarnerf {

/// The mean of paired differences, and what a t distribution says of it.
struct PairedDifference {
  int n = 0;                          ///< pairs
  double mean = 0.0;
  double low = 0.0, high = 0.0;       ///< ends of the 95 % interval of the mean
  double p = 1.0;                     ///< two-sided: probability of a mean as far from 0 if the true one is 0
  double smallest_detectable = 0.0;   ///< true mean that an interval of this width leaves 0 out for in 80 % of all studies
};

/// Of differences a_k − b_k between two methods, one of each draw. With s their standard deviation and n their number,
///
///     interval             mean ± t₀.₉₇₅(n − 1) s / √n
///     smallest detectable  (t₀.₉₇₅(n − 1) + t₀.₈(n − 1)) s / √n
///
/// With fewer than two pairs the interval is infinite and p is 1; without scatter p is 0 or 1. Throws UsageError without pairs.
PairedDifference paired_difference(std::span<const double> differences);

/// Standard error of a statistic by the jackknife (Efron 1982): of its values x_k without the k-th of n groups of samples,
///
///     √((n − 1) / n Σ (x_k − x̄)²),
///
/// which for a mean is s / √n. Groups must be independent, samples of one need not be. Throws UsageError for fewer than two groups.
double jackknife_error(std::span<const double> without_one);

/// p-values of several comparisons, raised by Holm's step-down method (1979): the probability that any of those up to this one is
/// found by chance stays below the value. In the order of `p`.
std::vector<double> holm(std::span<const double> p);

}  // namespace sarnerf
