// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// What training views show beyond a field, and how alike it is in neighbouring views.
///
/// A field holds what all views agree on. Measured targets glint into a few degrees, and chips whose apertures overlap
/// share their speckle: new views between them show some of that, too. Residuals of amplitude
///
///     r_k = G (a_k − b_k) / b_k − m,   a_k = √(I_k + f),   b_k = √(μ_k + f)
///
/// of view k, I its image, μ the field's, f a floor, G a narrow Gaussian, m the mean over the ground (speckle has less mean
/// amplitude than steady power), are taken for a random function of direction with the covariance s exp(−Δ/L) between
/// lines of sight Δ apart, besides 1 − s of each view's own. A new view is (b (1 + Σ w_k r_k))² − f, each r_k turned to it
/// on the ground, with the weights of simple kriging (Cressie 1993, section 3.2), K w = c over the six nearest views. What
/// stands above the ground is turned to a place beside its own, the more the further its view: amplitudes are blurred by a
/// tenth of a pixel for each degree between the two nearest views, 0.8 at most.
/// Amplitudes, since a glint of ten times the power would outweigh all neighbours otherwise.
///
/// What shines (two to four times as bright as the ground, blurred, and beyond) has a share of its own. Where residuals are
/// not alike, as under simulated, independent speckle, s is 0 and nothing is kept. Not in the paper.
struct ViewResiduals {
  std::vector<PosedImage> views;  ///< r_k in place of power; aim points are the origin of the field's frame
  double share = 0.0;             ///< s of the ground
  double target_share = 0.0;      ///< s of what shines
  double length_rad = 0.0;        ///< L
  double ground_power = 0.0;      ///< mean; f is a fifth of it
  double plane_height_m = 0.0;    ///< of the ground that residuals are turned on, relative to the aim point

  /// Weights of `near` (places in `views`) for a line of sight, where `share_of_it` is s.
  std::vector<double> weights(std::span<const std::size_t> near, const Acquisition& wanted, double share_of_it) const;

  /// Adds what is expected to an image that the field has rendered; never below 0.
  void correct(Image<float>& power, const Acquisition& wanted) const;
};

/// The residuals of the training views, with s and L of the ground fitted to pairs of neighbours; nothing where s is below
/// 2 %, where images have no speckled ground, or are fewer than six. A field has learned part of each view's speckle and
/// glints, so that its own residuals say too little (0.25 on the ground and 0.2 on the target of the chips of 2S1, whose
/// unseen views are best with 0.5 and 0.55 to 0.85): s is 0.5 at least, and the target's 0.7. Cost: a rendered image a view and six turned ones.
std::optional<ViewResiduals> find_residuals(const LearnedField& field, const TrainingSet& set);

}  // namespace sarnerf
