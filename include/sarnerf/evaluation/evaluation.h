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

/// What can be said of an image with a background beyond PSNR, which bright scatterers decide and speckle saturates
/// (docs/guide/metrics.md).
namespace sarnerf {

struct BackgroundRule {
  double range_db = 40.0;      ///< of log amplitudes, below the peak
  RegionRule regions{};        ///< target and shadow, of truth and of prediction
  LooksRule looks{};           ///< counted where the truth has neither
  int n_scatterers = 5;        ///< the strongest
  double separation_m = 1.0;   ///< between them
};

/// Scores of one image, or their means over views: of looks the harmonic mean, that of the fluctuation; of all else
/// the mean over the views that have a value. All finite.
struct BackgroundScores {
  double log_amplitude_error_db = 0.0;  ///< log_amplitude_error_db()
  double log_amplitude_psnr_db = 0.0;   ///< 20 log₁₀(range / that error), kMostPsnr_db at the most
  std::optional<double> looks, looks_of_truth;  ///< equivalent_looks(); none where there is too little background
  std::optional<double> target_iou, shadow_iou;  ///< none where neither image has such a region
  /// Mean distance of the truth's strongest scatterers to the nearest of as many of the prediction's; none where the
  /// truth has no pixel as bright as a target.
  std::optional<double> scatterer_error_m;
};

/// Judges a power image. Regions of the prediction follow the same rule, relative to its own background, so that a
/// factor on it changes no region; without a background it has no regions, and no overlap. A prediction without local
/// maxima misses the scatterers by the image's diagonal. Throws UsageError when sizes differ or the peak is not
/// positive. Cost: a blur, and some 10 passes over the image.
BackgroundScores score_background(const Image<float>& power, const PosedImage& truth, double peak,
                                  const BackgroundRule& rule = {});

/// Throws UsageError where there is none.
BackgroundScores mean_of(std::span<const BackgroundScores> views);

}  // namespace sarnerf

/// How good images of unseen views are, beside what interpolation between the training images gives on the very
/// same views.
namespace sarnerf {

/// Largest PSNR that a score can have (dB). Equal images would have an infinite one, which neither JSON nor a mean
/// can hold; 100 dB below the peak is far below all that is ever displayed or learned.
inline constexpr double kMostPsnr_db = 100.0;

/// PSNR after the best shift of a prediction: an upper bound for what its geometry can be, since the truth chooses the shift.
struct RegisteredScores {
  double psnr_power_db = 0.0, psnr_amplitude_db = 0.0;
};

/// Allows one shift of at most two pixels along each axis, and no gain: the one with the least square error of amplitude over the
/// even blocks of 16 x 16 pixels (a chessboard), found by whole pixels, then Gauss and Newton's steps. Scores are of the odd blocks.
/// Power is interpolated by Lanczos' kernel of eight taps, which keeps the band; the border is repeated. Throws UsageError when
/// sizes differ, the peak is not positive or the image has no odd block. Cost: 25 whole and 6 interpolated comparisons.
RegisteredScores score_registered(const Image<float>& power, const PosedImage& truth, double peak);

/// Scores of one image, or their means over views. All finite.
struct Scores {
  double psnr_power_db = 0.0;      ///< of linear power
  double psnr_amplitude_db = 0.0;  ///< of its square root
  /// Of power, over the dilated target; none where the truth is blank.
  std::optional<double> psnr_target_power_db;
  double ssim_power = 0.0;
  std::optional<double> lpips;  ///< none unless asked for
  std::optional<BackgroundScores> background;  ///< none where the truth's images have no background
  std::optional<RegisteredScores> registered;  ///< none unless asked for
};

/// One way of predicting images, judged on all views.
struct MethodScores {
  std::string name;
  std::vector<Scores> views;  ///< in the order of the truth
  Scores mean;                ///< of the values in dB; over the views that have a value
  int n_capped = 0;           ///< views whose PSNR of power stands at kMostPsnr_db
};

/// Which view a row of scores belongs to.
struct EvaluatedView {
  std::string name;
  double azimuth_rad = 0.0;
  double incidence_rad = 0.0;
};

struct Evaluation {
  double peak_power = 0.0;  ///< what all PSNR and SSIM refer to; amplitudes to its square root
  TargetRule target;
  std::vector<EvaluatedView> views;
  std::optional<MethodScores> prediction;  ///< none when only the baselines were judged
  std::vector<MethodScores> baselines;     ///< none without training images
  std::vector<MethodScores> bounds;        ///< what knows more than any method may
  std::optional<BackgroundRule> background;  ///< of the scores that need one; none where there are none

  /// The baseline with the highest mean PSNR of power; null where there is none.
  const MethodScores* best_baseline() const;

  /// Mean PSNR of power above the best baseline's (dB): what a learned field adds. None where either is missing.
  std::optional<double> margin_db() const;
};

/// A distance between two power images relative to a peak, smaller for more alike ones (nerf/lpips.h has one). Called
/// by the thread that called evaluate(), never inside a parallel loop.
using ImageDistance =
    std::function<double(const Image<float>& power, const Image<float>& truth, double peak)>;

/// Images to be judged beside the prediction that were made of what no method knows, such as other views of the truth.
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
  bool oracle_registered = false;  ///< score_registered() every image, too
  BackgroundRule background;  ///< of use where the truth has_visible_background()
};

/// Largest power of all images. Throws InputError when they are blank or there are none: nothing can be compared
/// relative to them.
double peak_power(std::span<const PosedImage> images);

/// Scores of one image, relative to a peak. Throws UsageError when sizes differ or the peak is not positive;
/// NumericsError, naming the view, for an image that holds values that are not finite. Powers below zero, which a
/// method may predict, have amplitude zero. Without LPIPS and score_background().
Scores score_view(const Image<float>& power, const PosedImage& truth, double peak,
                  const TargetRule& target = {});

/// Judges predictions of the views in `truth`, and each baseline and bound on the same views. `predictions` are linear power
/// on the grids of the truth, one a view, or none at all; without `training` there are no baselines and the
/// settings must name the peak. Throws UsageError when counts or sizes do not fit or there is no view, NumericsError
/// for predictions that are not finite, InputError for blank training images, Interrupted when the monitor asks
/// for it. Views in parallel, the same result for any number of threads; LPIPS one after the
/// other. Memory: one image a thread.
Evaluation evaluate(std::span<const PosedImage> truth, std::span<const Image<float>> predictions,
                    std::span<const PosedImage> training, const EvaluationSettings& settings = {},
                    const Monitor& monitor = {});

}  // namespace sarnerf

namespace sarnerf {

/// Measured views averaged with their neighbours, for want of a truth without speckle.
struct DespeckledTruth {
  std::vector<std::size_t> which;  ///< places of these views among those that the truth was made of
  std::vector<PosedImage> views;  ///< the truth, each named and posed as the view in its middle
  /// Of each, the mean of other views about it: an estimate as good as the truth itself and independent of it. What is
  /// as close to the truth as this is as good as measuring.
  std::vector<Image<float>> true_neighbours;
};

/// Splits views that nobody trained on, pitch by pitch (see Interpolation), into the first, third, fifth … and the
/// second, fourth, … in the order of azimuth. The truth is the mean of the odd views, in power, not further than
/// `reach_rad` in azimuth from an odd one, each turned to its azimuth and incidence as rotated_linear turns them, by
/// the level plane through the aim point: over a few degrees its height matters little. Its true neighbours are
/// the same of the even views. Odd views without another odd one and without an even one within reach are left out.
///
/// At intervals of a degree a reach of 3° has two or three views each, so that the truth keeps some speckle, and no
/// method that is judged by it can come as close as to a clean one.
///
/// Throws UsageError for a reach that is not in (0, π), and as interpolate_view() for the views. Cost: a turned image
/// for each view within reach.
DespeckledTruth despeckled_truth(std::span<const PosedImage> unseen, double reach_rad);

/// evaluate() on a despeckled truth, with two bounds: its true neighbours, and those blurred (σ of one pixel).
/// `predictions` are of all the views that the truth was made of, in their order, or none. Settings' own bounds must
/// be of the truth's views. Throws and costs as evaluate().
Evaluation evaluate_despeckled(const DespeckledTruth& truth,
                               std::span<const Image<float>> predictions,
                               std::span<const PosedImage> training, EvaluationSettings settings = {},
                               const Monitor& monitor = {});

}  // namespace sarnerf
