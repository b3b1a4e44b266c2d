// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// Whether an image can have this depression (deg): the incidence, 90° minus it, lies inside (0°, 90°) even after
/// rounding.
constexpr bool is_depression(double depression_deg) {
  return depression_deg > 0.0 && depression_deg < 90.0 && 90.0 - depression_deg < 90.0;
}

/// An image and how it was taken: rows are azimuth rows i, columns slant-range bins j, near to far.
struct PosedImage {
  std::string name;         ///< the image's path in its dataset
  Acquisition acquisition;  ///< aim point and angles in radians
  Image<float> power;       ///< linear power: stored value × scale, squared where the dataset holds amplitudes
};

/// Reads the images of views `which` (indices into dataset.views), brings their axes to [+i, +j], applies the
/// dataset's scale and squares amplitudes. Throws InputError, naming the image, where it is missing, has other
/// sizes than the manifest says, or holds negative values or values that are not finite; Interrupted when the
/// monitor asks for it. Cost: reading the files, in parallel.
std::vector<PosedImage> load_images(const std::filesystem::path& folder, const Dataset& dataset,
                                    std::span<const std::size_t> which, const Monitor& monitor = {});

/// The file's rows and columns turned and mirrored to [+i, +j]. Throws UsageError where both axes run along i, or
/// both along j.
Image<float> to_radar_axes(const Image<float>& file, const std::array<Axis, 2>& axes);

}  // namespace sarnerf

/// Registration.
namespace sarnerf {

/// Standard deviation (pixels, along each axis) of the cut positions of measured chips, used as prior of their shifts.
/// Four MSTAR targets have 0.6 to 0.8 (docs/method/learning.md).
inline constexpr double kCut_pixels = 1.0;

/// Removes the scene's common translation t from the images' shifts. It shifts view v by h_v · t along track and by
/// k_v · t in range, and no set of images determines it. Least squares over all views; fewer than two are unchanged.
void remove_common_translation(std::span<PosedImage> images);

}  // namespace sarnerf

/// The background of images around the scene: none, an even ground, or speckle.
namespace sarnerf {

/// Whether most of the pixels return power: the images show ground or clutter, and zeros are no evidence of empty space.
bool has_background(std::span<const PosedImage> images);

/// Whether that background is visible: most of the pixels return more than 80 dB below the brightest one. The tails of
/// an impulse response or of a smooth object are positive everywhere, but are no background.
bool has_visible_background(std::span<const PosedImage> images);

/// Equivalent number of looks of the images' speckle: the median over up to 24 views of equivalent_looks() at the
/// quantile 0.9 of each view's windows. Texture of a ground without speckle has flat windows, speckle has none: the
/// flattest windows distinguish them. The estimate is therefore too high by about half, and by a factor of 2.5 where
/// neighbouring pixels are highly correlated (figures: equivalent_looks()). None without a visible background.
std::optional<double> looks_of(std::span<const PosedImage> images);

/// Whether speckle is worth suppressing: a visible background of fewer than 50 looks, a fluctuation of 14 % or more.
bool is_speckle(std::optional<double> looks);
bool is_speckled(std::span<const PosedImage> images);

/// Indices of incidences (rad), grouped by pitch, smallest first. Sorted incidences belong to one pitch as long as they
/// follow each other by 0.25° or less. Within a pitch, indices keep their order.
std::vector<std::vector<std::size_t>> indices_by_pitch(std::span<const double> incidence_rad);

}  // namespace sarnerf

namespace sarnerf {

/// A pixel that no scatterer explains.
struct Outlier {
  std::size_t image = 0;  ///< index in the list of images
  int i = 0, j = 0;       ///< azimuth row, range bin
  float power = 0.0f;     ///< as it was found
  float limit = 0.0f;     ///< the largest power of the pixels that are no outliers
};

/// Damaged pixels of a set of images of one scene, brightest first.
///
/// A scatterer is seen in more than one pixel: the impulse response spreads it, and other views see it, too. So the
/// sorted powers of a set of images have no large gap up to the largest. Pixels above the lowest gap of a factor of ten
/// among the largest powers are outliers if they are at most one in 10,000 (or a single one) and lie in at most a quarter
/// of the images; sets of fewer than four images have none. A flash of a wall, which is bright in one view only, has more
/// pixels than that. No outlier was found in the solids, vehicles and buildings that this project measures with, clean or
/// speckled, nor in any of the ten classes of MSTAR.
///
/// Cost: one pass over all pixels.
std::vector<Outlier> find_outliers(std::span<const PosedImage> images);

/// Sets the outliers of find_outliers() to their limit and returns them. Otherwise one such pixel would dominate every
/// mean square and set the peak that every PSNR refers to.
std::vector<Outlier> limit_outliers(std::span<PosedImage> images);

/// One line for a warning: the image, the pixel, its power, and the power that is used instead.
std::string outlier_text(const Outlier& outlier, std::span<const PosedImage> images);

}  // namespace sarnerf
