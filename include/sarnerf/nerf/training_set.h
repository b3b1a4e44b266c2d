// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

/// Training data of a field: images of one scene, in a frame that is centred on their aim point.
struct TrainingSet {
  std::vector<PosedImage> images;  ///< their acquisitions' aim is the origin
  Box box_m;                       ///< region that may be occupied, relative to the aim point
  Box whole_box_m;                 ///< the dataset's, of which that is a part if the images show a ground
  float peak = 0.0f;               ///< largest pixel after outliers are limited; reference of PSNR
  std::vector<Outlier> outliers;   ///< as they were found; in `images` they are set to their limit
  float bright = 0.0f;             ///< mean of the brightest hundredth of the pixels above 0: scale of the brightness
  GroundRule ground_rule;          ///< parameters of `ground` and of carving over it
  std::optional<GroundEstimate> ground;  ///< a level ground, if the images show one
  bool exact_poses = true;         ///< acquisitions are exact; else shifts and gains of the views are learned
  bool background = false;         ///< most pixels return power: zeros are no evidence of empty space
  bool tails_are_dark = false;     ///< pixels 40 dB below the peak were set to 0
  /// Resolution of the radar that made the images, if the field is to be the scene without its impulse response.
  std::optional<Resolution> resolution;
  /// Deconvolved images, if there is a `resolution` and no speckled ground; images without tails, if `tails_are_dark`.
  std::vector<PosedImage> deconvolved;

  /// Images for learning and carving: `deconvolved` if there are any, else `images`.
  const std::vector<PosedImage>& training_images() const { return deconvolved.empty() ? images : deconvolved; }
  /// Smallest range spacing of the images (m).
  double finest_bin_m() const;
};

/// One azimuth row of one of the images.
struct RowReference {
  std::uint32_t view, row;
};

/// Known heights of a scene. Those that are not given follow from its box and images.
struct SceneHeights {
  /// Height of the ground, in world coordinates. Default: the bottom of the box, or the height at which speckled views agree
  /// on the texture of a level ground, since chips are centred on targets, and the ground lies below those.
  std::optional<double> ground_m;
  /// Greatest height of objects above a level ground. Default under speckle: the height at which the shadow of a point above the
  /// aim point leaves some view (what is higher no chip can disprove), or a quarter of the swath in ground range if that is less
  /// (from a depression of 26.6° on). Default otherwise: the box's top.
  std::optional<double> above_ground_m;
};

/// The training set of a dataset's images. `scene_box_m` is in world coordinates, as in a manifest. The set's box begins at the
/// ground's height, if that is given or estimated.
///
/// `resolution`: of the radar that made the images. Over a speckled ground the impulse response is part of the model, since
/// deconvolution would turn speckle into spikes. Otherwise learning, carving and the ground's estimate use deconvolved
/// images. The resolution is ignored if images look speckled and are too few to estimate their ground.
///
/// Dark pixels may be tails of an impulse response. They are set to 0, so that they carve, if the images show no level
/// ground, no resolution is used, most pixels return power, and four fifths of them are 40 dB below the brightest one.
///
/// Throws InputError for images without any power or of pixels that are all equal, and UsageError if the given ground is not
/// below the box's top.
TrainingSet training_set(std::vector<PosedImage> images, const Box& scene_box_m, const SceneHeights& heights = {},
                         const std::optional<Resolution>& resolution = {}, const GroundRule& ground_rule = {});

/// The set for the field `paper`, which knows images alone: without ground, impulse response, deconvolved images and shifts.
TrainingSet images_alone(TrainingSet set);

/// The set without the views at these indices, ascending. All that was estimated from all views stays: box, ground, brightness.
TrainingSet without_views(const TrainingSet& set, std::span<const std::size_t> views);

}  // namespace sarnerf
