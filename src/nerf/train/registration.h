// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "files/archives.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/training_set.h"
#include "train/loss.h"

namespace sarnerf {

/// Learns a shift and a log gain of every view together with the field (bundle adjustment; Lin et al. 2021 do it for cameras):
/// between steps of the field, now and then, one Gauss–Newton step of each view's azimuth shift α, range shift ρ and log gain γ,
///
///     least  Σ_pixels [e + (α ∂μ/∂a + ρ ∂μ/∂r + γ μ) / d]² / σ²  +  (α₀ + α)² / τ² + (ρ₀ + ρ)² / τ²
///
/// with μ the rendered view, e and d the pixel loss's error and its denominator, σ² the mean of e², α₀ and ρ₀ the
/// shifts so far and τ a Gaussian prior's standard deviation (kCut_pixels). Derivatives along the axes are central differences of the
/// rendered view: a shifted image plane samples the same continuous image elsewhere. The measured pixels are never interpolated, which
/// would smooth their speckle and lower the loss by itself; images are divided by their gains.
///
/// After each pass the common translation and the mean log gain are taken out.
class ViewRegistration {
 public:
  /// `n_passes` at equal distances in the first `until` of the training; none: nothing is ever due.
  explicit ViewRegistration(int n_passes = 0) : n_passes_(n_passes) {}

  bool is_due(double progress) const { return n_done_ < n_passes_ && progress >= kUntil * (n_done_ + 1) / n_passes_; }
  bool is_complete() const { return n_passes_ > 0 && n_done_ == n_passes_; }

  /// One pass over all views: moves the acquisitions of `set` and divides its images by their gains.
  void pass(TrainingSet& set, const LearnedField& field, const PixelLoss& pixel, const Monitor& monitor = {});

  /// Shifts, gains and passes so far, for a checkpoint; restore() applies them to a set that was made anew.
  void save(Archive& archive, const TrainingSet& set) const;
  void restore(const Archive& archive, TrainingSet& set, const std::string& where);

 private:
  /// The rest of the training has no pass: the field settles on the shifts.
  static constexpr double kUntil = 0.6;

  void remember(const TrainingSet& set);
  void divide_by_gains(TrainingSet& set) const;

  int n_passes_ = 0, n_done_ = 0;
  std::vector<double> gain_;  ///< of each view, that its image is divided by
  std::vector<Image<float>> images_, deconvolved_;  ///< before that, so that rounding does not depend on the number of passes
};

}  // namespace sarnerf
