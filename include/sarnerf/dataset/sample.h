// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "sarnerf/dataset/chip.h"

namespace sarnerf {

/// Reads a measured or synthetic chip of the SAMPLE set, a MATLAB file of version 5 with complex_img, azimuth,
/// elevation (its depression, deg), range_pixel_spacing, xrange_pixel_spacing (m) and target_name. Its array, as MATLAB
/// shows it, is the transpose of an MSTAR chip; the result is read as chip_of() reads those. SAMPLE publishes no
/// ranges: `assumed_range_m` stands for them. The serial is taken from the file's name ("…_serial_b01.mat").
///
/// Throws InputError for other files, files of version 7.3 (HDF5), truncated ones, variables that are missing or of
/// another type or size, and pixels that are not finite. Part of the target sarnerf::dataset_import.
Chip read_sample(const std::filesystem::path& path, double assumed_range_m);

}  // namespace sarnerf
