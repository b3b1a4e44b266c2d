// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf {

/// An image and how it was taken: rows are azimuth rows i, columns slant-range bins j, near to far.
struct PosedImage {
  std::string name;         ///< the image's path in its dataset
  Acquisition acquisition;  ///< aim point and angles in radians
  Image<float> power;       ///< linear power: stored value × scale, squared where the dataset holds amplitudes
};

/// Reads the images of views `which` (places in dataset.views), brings their axes to [+i, +j], applies the
/// dataset's scale and squares amplitudes. Throws InputError, naming the image, where it is missing, has other
/// sizes than the manifest says, or holds negative values or values that are not finite; Interrupted when the
/// monitor asks for it. Cost: reading the files, in parallel.
std::vector<PosedImage> load_images(const std::filesystem::path& folder, const Dataset& dataset,
                                    std::span<const std::size_t> which, const Monitor& monitor = {});

/// The file's rows and columns turned and mirrored to [+i, +j]. Throws UsageError where both axes run along i, or
/// both along j.
Image<float> to_radar_axes(const Image<float>& file, const std::array<Axis, 2>& axes);

}  // namespace sarnerf
