// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "files/archives.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/training_set.h"
#include "train/loss.h"

namespace sarnerf {

/// Learns a shift and a log gain of every view together with the field (bundle adjustment; Lin et al. 2021 do it for
/// cameras). Each pass, between two steps of the field, makes one Gauss–Newton step of every view's azimuth shift α, range
/// shift ρ and log gain γ, 1.5 times as long as it would be, and half a pixel and a log gain of 0.5 at most. It minimises
///
///     Σ_pixels [e + (α ∂μ/∂a + ρ ∂μ/∂r + γ μ) / d]² / σ²  +  (α₀ + α)² / τ² + (ρ₀ + ρ)² / τ²
///
/// with μ the rendered view, e and d the pixel loss's error and its denominator, σ² the mean of e², α₀ and ρ₀ the
/// shifts so far and τ a Gaussian prior's standard deviation (kCut_pixels). Derivatives along the axes are central
/// differences of the rendered view: a shifted image plane samples the same continuous image at other points. The
/// measured pixels are never interpolated: that would smooth their speckle, and lower the loss for that reason alone.
/// Images are divided by their gains.
///
/// Each pass ends with the removal of the common translation and the mean log gain.
class ViewRegistration {
 public:
  /// `n_passes` at equal intervals up to the progress kUntil; 0: none is ever due.
  explicit ViewRegistration(int n_passes = 0) : n_passes_(n_passes) {}

  bool is_due(double progress) const { return n_done_ < n_passes_ && progress >= kUntil * (n_done_ + 1) / n_passes_; }
  bool is_complete() const { return n_passes_ > 0 && n_done_ == n_passes_; }

  /// One pass over all views: moves the acquisitions of `set` and divides its images by their gains.
  void pass(TrainingSet& set, const LearnedField& field, const PixelLoss& pixel);

  /// Shifts, gains and number of passes, for a checkpoint; restore() applies them to a newly made set.
  void save(Archive& archive, const TrainingSet& set) const;
  void restore(const Archive& archive, TrainingSet& set, const std::string& where);

 private:
  /// Progress of the last pass. In the rest of the training, the field adapts to the final shifts.
  static constexpr double kUntil = 0.6;

  void remember(const TrainingSet& set);
  void divide_by_gains(TrainingSet& set) const;

  int n_passes_ = 0, n_done_ = 0;
  std::vector<double> gain_;  ///< of each view; its image is divided by it
  std::vector<Image<float>> images_, deconvolved_;  ///< undivided, so that rounding does not depend on the number of passes
};

}  // namespace sarnerf
