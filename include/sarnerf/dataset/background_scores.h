// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "sarnerf/core/image.h"
#include "sarnerf/core/looks.h"
#include "sarnerf/core/regions.h"
#include "sarnerf/dataset/posed_image.h"

/// What can be said of an image with a background beyond PSNR, which bright scatterers decide and speckle saturates
/// (docs/metrics.md).
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
