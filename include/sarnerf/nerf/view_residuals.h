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
///     r_k = G (a_k − b_k) / b_k,   a_k = √(I_k + f),   b_k = √(μ_k + f)
///
/// of view k, I its image, μ the field's, f a floor, G a narrow Gaussian, are taken for a random function of direction with
/// the covariance s exp(−Δ/L) between lines of sight Δ apart, besides 1 − s of each view's own. A new view is
/// (b (1 + Σ w_k r_k))² − f, each r_k turned to it on the ground, with the weights of simple kriging (Cressie 1993, section
/// 3.2), K w = c over the six nearest views. What stands above the ground is turned to a place beside its own, the more the
/// further its view: where targets glint, amplitudes are blurred by a tenth of a pixel for each degree between the two
/// nearest views, 0.8 at most. Amplitudes, since a glint of ten times the power would outweigh all neighbours otherwise.
///
/// What shines (two to four times as bright as the ground, blurred, and beyond) has a share of its own, and counts its r from
/// the ground's mean, which is that of speckle's amplitude. Where the ground's
/// residuals are not alike, as under simulated, independent speckle, s is 0 and nothing is added. Not in the paper.
struct ViewResiduals {
  std::vector<PosedImage> views;  ///< r_k in place of power; aim points are the origin of the field's frame
  double share = 0.0;             ///< s of the ground
  double target_share = 0.0;      ///< s of what shines
  double length_rad = 0.0;        ///< L
  double ground_mean = 0.0;       ///< of r over the ground: speckle has less mean amplitude than steady power
  double glints = 0.0;            ///< variance of r by which what shines exceeds the ground's speckle
  double ground_power = 0.0;      ///< mean; f is a fifth of it
  double plane_height_m = 0.0;    ///< of the ground that residuals are turned on, relative to the aim point

  /// Weights of `near` (places in `views`) for a line of sight, where `share_of_it` is s.
  std::vector<double> weights(std::span<const std::size_t> near, const Acquisition& wanted, double share_of_it) const;

  /// Adds what is expected to an image that the field has rendered; never below 0.
  void correct(Image<float>& power, const Acquisition& wanted) const;
};

/// The residuals of the training views; nothing where images have no level ground, or are fewer than six. L and the
/// ground's s are fitted to pairs of neighbours, less the ground's mean. The field has learned part of each view's speckle, so
/// that residuals of unseen chips of 2S1 ask for 2.5 times the s of trained ones: that is kept, 0.9 at most, and 0 where pairs
/// say less than 0.02. Of what shines, it is the share of its variance that the ground's speckle does not explain, 0.65 to
/// 0.77 on four measured targets (unseen chips of 2S1 are best with 0.55 to 0.85), less in proportion where glints are below
/// 0.15: of 0.02 and less, as under simulated speckle, those residuals are errors of the field that neighbours do not share, and
/// adding a third of them costs the L-shaped building 1.3 dB of power. Cost: a rendered image a view and six turned ones.
std::optional<ViewResiduals> find_residuals(const LearnedField& field, const TrainingSet& set);

}  // namespace sarnerf
