// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/evaluation/baseline.h"

namespace sarnerf {

/// Views of a training set, or of part of it.
using Views = std::span<const PosedImage* const>;

/// All training views, each checked: throws as interpolate_view() does for them.
std::vector<const PosedImage*> checked_views(std::span<const PosedImage> training);

/// A training view and its weight in a prediction. Weights add up to 1.
struct Neighbour {
  const PosedImage* view;
  double weight;
};

/// Views of nearly equal incidence.
struct Pitch {
  double incidence_rad = 0.0;  ///< mean over the views
  std::vector<const PosedImage*> views;
};

/// The views grouped by incidence, smallest first. Within a pitch they keep their order.
std::vector<Pitch> pitches(Views training);

/// The view whose line of sight is nearest to the wanted one; the first of equally near ones.
Neighbour nearest_view(Views training, const Acquisition& wanted);

/// The next view on each side in azimuth, around the circle, with weights that are linear in azimuth. A single view if
/// one has the wanted azimuth or there is only one. Of several at one azimuth, the one nearest in incidence; of equally
/// near ones, the first.
std::vector<Neighbour> azimuth_neighbours(const Pitch& pitch, const Acquisition& wanted);

/// The six views nearest in azimuth, on either side, or all if there are fewer, with equal weights. Of equally near
/// ones, those nearest in incidence; of equals, the first.
std::vector<Neighbour> nearest_azimuths(const Pitch& pitch, const Acquisition& wanted);

/// The pitch nearest in incidence; of equally near ones, the smaller.
const Pitch& nearest_pitch(std::span<const Pitch> all, double incidence_rad);

/// The neighbours that `of_pitch` finds at the pitches below and above, with weights that are linear in incidence too.
/// Beyond the outermost pitch, the neighbours at that pitch alone.
std::vector<Neighbour> neighbours_of_two_pitches(
    std::span<const Pitch> all, const Acquisition& wanted,
    std::vector<Neighbour> (*of_pitch)(const Pitch&, const Acquisition&));

/// How a training image is warped before it is averaged.
enum class Warp { none, rescale, turn };

/// A training image on the grid of the wanted view, looked up pixel by pixel. See interpolate_view().
class WarpedView {
 public:
  /// `image` and `wanted` must outlive the object.
  WarpedView(const PosedImage& image, const Acquisition& wanted, Warp warp, double plane_height_m, Resampling resampling);

  double value(int i, int j) const;

 private:
  double at(double along_track_m, double range_offset_m) const;

  const PosedImage& image_;
  Image<float> amplitude_;  ///< of cubic resampling; else empty
  Acquisition view_;
  const Acquisition& wanted_;
  RadarFrame frame_;
  RadarPoint aim_{};  ///< the wanted aim point as this view sees it
  bool through_plane_ = false, mirrored_ = false;
  double plane_height_m_ = 0.0;
  std::vector<double> plane_offset_m_;
  glm::dvec3 along_track_{0.0}, away_{0.0};
};

/// √P, and 0 for powers below zero.
Image<float> amplitude_of(const Image<float>& power);

/// The quantity that is averaged and returned.
enum class Average { power, amplitude };

/// interpolate_view() between checked views, which may be a part of the training set.
Image<float> interpolate_between(Views training, const Acquisition& wanted, Interpolation method,
                                 double plane_height_m, Average average = Average::power,
                                 Resampling resampling = Resampling::bilinear);

/// Σ weight × view on the grid of `wanted`, each warped by the plane. See interpolate_view().
Image<float> weighted_mean(std::span<const Neighbour> neighbours, const Acquisition& wanted,
                           Warp warp, double plane_height_m, Average average = Average::power,
                           Resampling resampling = Resampling::bilinear);

/// Leave-one-out cross-validation on the training images: up to twelve of them, spread over the set, are each predicted
/// from all others.
class LeaveOneOut {
 public:
  /// Views and monitor must outlive the object.
  LeaveOneOut(Views views, const Monitor& monitor);

  /// Whether validation is possible: at least two views, and some power in them.
  bool possible() const { return views_.size() > 1 && peak_ > 0.0; }

  /// Predicts the image of a view from the remaining views.
  using Predict = std::function<Image<float>(Views others, const Acquisition& wanted)>;

  /// Mean PSNR of power (dB), at most 100 for a view so that duplicates do not decide. Throws Interrupted when the
  /// monitor asks for it.
  double psnr_db(const Predict& predict) const;

 private:
  Views views_;
  const Monitor& monitor_;
  double peak_ = 0.0;
};

}  // namespace sarnerf
