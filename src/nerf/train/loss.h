// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <torch/types.h>

#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/trainer.h"
#include "sarnerf/nerf/training_set.h"
#include "train/response.h"

// What learning minimises (docs/method/equations.md, E8), its value and its gradient:
//
//     L = Σ_pixels e e',      e = (μ − I) / d
//
// μ is the power that the field renders, I the image, and e' the error of another rendering of the same pixels from rays of its
// own, or e itself. Rays of one rendering are few, and the square of its error contains their variance: the field that minimises
// it is biased towards one that renders with less noise. The product of two independent errors has the mean (E μ − I)², without
// it. There is no prior: none passed the ablation (docs/results/ablation.md).

namespace sarnerf {

/// The product e e' of one pixel's errors (μ − I) / d in two renderings, in units of an error's standard deviation:
///
///     d² = relative² sg(μ)² + absolute²        sg(μ): max(0, mean of both), held constant
///
/// relative = 0 is printed eq. 31 in units of `absolute`. Else, with d = sg(μ) + ε instead, it is RawNeRF's (Mildenhall et
/// al. 2022). With `root` > 0, errors are those of roots, and d is constant:
///
///     e = [√(μ + ε) − √(I + ε)] / √absolute,        ε = root · absolute
///
/// With a `bound` b (Huber 1964), a pixel's part of the loss grows linearly beyond: with n(e) = clamp(e, −b, b),
///
///     n(e) n(e') + b (|e − n(e)| + |e' − n(e')|)
struct PixelLoss {
  double relative = 0.0;  ///< standard deviation of an error, as a fraction of μ
  double absolute = 1.0;  ///< the same where nothing is rendered, a power
  double root = 0.0;      ///< ε over `absolute`; 0: errors of power
  double bound = std::numeric_limits<double>::infinity();  ///< of errors of power, standard deviations

  double denominator(double rendered) const {
    const double part = relative * std::max(0.0, rendered);
    return std::sqrt(part * part + absolute * absolute);
  }

  struct Term {
    double value;                ///< e e'
    double by_first, by_second;  ///< derivatives by the two renderings with d held constant
  };
  Term of(double first, double second, double image) const;
};

/// Over a level ground of mean power c, seen with L looks (∞ where images are clean), with m the option `misfit`:
///
///     d² = sg(μ)² / L + m² (sg(μ)² + c²)
///
/// The first term is the variance of speckle. The second is that of the field itself: it cannot follow every pixel of a scene,
/// bright or dark. Without a ground, or with m = 0, squares of power in units of the peak; for the field `surface`, of the root of
/// power: a surface that is a little wrong moves power between pixels, in proportion to its amount, so that variances, not
/// deviations, are proportional to power. Over a ground, errors of `surface` are bounded by the option `error_bound`: a body's
/// flashes are up to a thousand times as bright as the ground, and would else outweigh its shadow.
PixelLoss pixel_loss(const TrainingSet& set, const TrainerOptions& options);

/// Azimuth rows of several views, their pixels one behind the other.
struct RowBatch {
  std::vector<RowReference> rows;
  std::vector<RowRequest> requests;  ///< of all rows in their order, for each rendering one behind the other
  std::vector<float> image;          ///< I
  std::vector<std::uint8_t> counts;  ///< 0 for pixels whose rays are not rendered
};

/// The data term of a batch: a value and its gradient.
struct DataLoss {
  double value = 0.0;           ///< Σ e e' over n_pixels pixels
  std::size_t n_pixels = 0;
  torch::Tensor gradient;       ///< ∂value/∂(rendered pixel), [renderings × n]; 0 for pixels that do not count
  double square_error = 0.0;    ///< Σ (μ − I)² over the same pixels, μ the mean of the renderings, whatever d is
  double image_square = 0.0;    ///< Σ I²: the square error of a black image

  double per_pixel(double sum) const { return sum / static_cast<double>(std::max<std::size_t>(1, n_pixels)); }
};

/// The data term, of single rows or through an impulse response.
///
/// Deconvolved images (train/response.h) are learned row by row. Speckle cannot be deconvolved. There the response B is a part of
/// the model, μ = B f with f what the field renders, and the value is that of the views that have rows in the
/// batch:
///
///     value = Σ e e',      e = (B f − I) / d,      ∂ value / ∂ f = Bᵀ [e' / d]
///
/// over the rows of these views whose neighbours, as far as the response reaches, are all rendered in this batch or never change.
/// (Counting rows beside old ones makes a field too bright: it makes up for neighbours that are not there yet.)
///
/// Rows of f are rendered a few at a time. Other rows of a view keep their values from the step that rendered them last;
/// until then they show the bare ground, as pixels do that no voxel can change. Cost through a response: the batch's rows
/// times a matrix of the image's size for each axis, and the pixels of all their views.
class DataTerm {
 public:
  /// Through the set's impulse response where the images are not deconvolved. `n_renderings`: 1, or 2 independent ones of each
  /// row. `set` is not kept. Throws UsageError where a spacing under-samples the resolution.
  DataTerm(const TrainingSet& set, const PixelLoss& pixel, int n_renderings = 1);

  const PixelLoss& pixel() const { return pixel_; }
  /// Neighbouring rows that a batch should have together: 1, or through a response so many that most of them have all the rows in
  /// it that the response mixes with them. Rows of other batches have old values.
  std::uint32_t rows_of_a_block() const { return rows_of_a_block_; }

  /// After gains, shifts or ground of the views have changed, or the field's occupied space. Of f, what the rows `rows` show
  /// in their view's window is kept, and the rest is the ground: no voxel can change it.
  void update(const TrainingSet& set, std::span<const RowReference> rows, std::span<const LayoverShadowWindow> windows);

  /// `rendered`: pixels of the batch's rows as the field has them, [n] float32 for each rendering, one behind the other.
  DataLoss of(const RowBatch& batch, const torch::Tensor& rendered);

  /// Rows that were rendered last, under "rendered_rows" and "seen_rows", where there is a response; and back. Throws
  /// CheckpointError.
  void save(Archive& archive) const;
  void restore(const Archive& archive, const std::string& where);

 private:
  struct Rendering {
    torch::Tensor rendered;  ///< f
    torch::Tensor seen;      ///< B f, kept up to date as rows of f change
  };
  struct View {
    torch::Tensor azimuth, range;  ///< A [n_azimuth, n_azimuth] and R [n_range, n_range], symmetric: B f = A f R
    torch::Tensor image;           ///< I
    std::vector<Rendering> renderings;
    int border = 0;                 ///< rows within which the response has all but 1 % of its energy
    std::vector<std::uint8_t> learned;  ///< of each row: 1 if voxels can change it
  };
  DataLoss of_rows(const RowBatch& batch, const float* rendered) const;
  DataLoss through_response(const RowBatch& batch, const float* rendered);

  PixelLoss pixel_;
  std::size_t n_renderings_;
  std::uint32_t rows_of_a_block_ = 1;
  std::vector<View> views_;  ///< with a response only
};

/// Detects divergence. It compares mean square errors of power, whichever the loss is: an error over its standard deviation
/// stays below 1 / relative, however bright the field is. The field has diverged if its error is a thousand times the least
/// so far, and ten times the sum of the mean squares of all training pixels and of the batch's. (A batch may show almost
/// nothing, so that the least error is near 0: the second comparison then decides.)
class DivergenceGuard {
 public:
  explicit DivergenceGuard(const TrainingSet& set);

  /// Throws NumericsError for a step whose loss is not finite or whose field has diverged.
  void check(const DataLoss& loss, std::int64_t step);

  double least() const { return least_; }  ///< least mean square error so far, over the peak's square
  void set_least(double least) { least_ = least; }

 private:
  double peak_, mean_square_;
  double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace sarnerf
