// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

/// What a field learns from: images of one scene, in a frame that is centred on their aim point.
struct TrainingSet {
  std::vector<PosedImage> images;  ///< their acquisitions' aim is the origin
  Box box_m;                       ///< where matter may be, relative to the aim point
  float peak = 0.0f;               ///< largest pixel that is no outlier: what PSNR refers to
  std::vector<Outlier> outliers;   ///< as they were found; `images` hold their limit
  float bright = 0.0f;             ///< mean of the brightest hundredth of the pixels above 0: scale of the brightness
  GroundRule ground_rule;          ///< of the next, and of space over it
  std::optional<GroundEstimate> ground;  ///< a level ground, where the images show one
  bool exact_poses = true;         ///< views are where their acquisitions say; else their shifts and gains are learned
  bool background = false;         ///< most pixels return power: zeros tell nothing of space
  bool tails_are_dark = false;     ///< pixels 40 dB below the peak are taken for 0
  /// Of the radar that made the images, where the field is to be the scene without its impulse response.
  std::optional<Resolution> resolution;
  /// Unless images show a speckled ground: deconvolved ones; or those without tails.
  std::vector<PosedImage> deconvolved;

  /// What the field is learned and carved from: `deconvolved` where there are any, else the images.
  const std::vector<PosedImage>& training_images() const { return deconvolved.empty() ? images : deconvolved; }
};

/// One azimuth row of one of the images.
struct RowReference {
  std::uint32_t view, row;
};

/// What is known of a scene beside its box, which else follows from the images.
struct SceneHeights {
  /// Of the ground, in world coordinates: unless told, the bottom of the box, or where speckled views agree on the texture
  /// of a level ground: chips are centred on targets, and the ground lies below that.
  std::optional<double> ground_m;
  /// Greatest height of matter above a level ground. Unless given, under speckle a quarter of the level width that a view
  /// sees, since chips do not bound the height of a voxel whose shadow lies outside of them; else the box's.
  std::optional<double> above_ground_m;
};

/// The set of a dataset's images. `scene_box_m` is in world coordinates, as in a manifest; its bottom becomes the ground's
/// height.
///
/// `resolution`: of the radar that made the images. Over a speckled ground it is a part of the model, since deconvolution would
/// turn speckle into spikes. Else all that is learned, carved and estimated of a ground comes from deconvolved images. It is left
/// out where images look speckled and are too few to estimate their ground.
///
/// Where images show no level ground and four fifths of their pixels
/// are 40 dB darker than the brightest one and no resolution is told, those are the tails of an impulse response, and count as
/// 0: what is dark carves.
///
/// Throws InputError for images without any power or of pixels that are all equal, and UsageError where the ground that is told is not below the box's top.
TrainingSet training_set(std::vector<PosedImage> images, const Box& scene_box_m, const SceneHeights& heights = {},
                         const std::optional<Resolution>& resolution = {}, const GroundRule& ground_rule = {});

}  // namespace sarnerf
