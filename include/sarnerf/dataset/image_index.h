// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sarnerf/dataset/phoenix.h"

/// The images in a folder and their acquisition, from a table or from file names, before pixels are read.
namespace sarnerf {

/// An image file and its acquisition, as far as it is known.
struct IndexedImage {
  std::filesystem::path file;
  double azimuth_deg = 0.0;
  std::optional<double> depression_deg;
  std::optional<double> slant_range_m, azimuth_spacing_m, range_spacing_m;
  std::string class_name, serial, split;  ///< empty: unknown
};

/// Reads a table (CSV, RFC 4180) whose first line names its columns: `file`, `azimuth_deg` and, optionally,
/// `depression_deg` or `incidence_deg`, `slant_range_m`, `azimuth_spacing_m`, `range_spacing_m`, `class`, `serial`,
/// `split`. Other columns are ignored; an empty optional field means unknown. Files are searched beside the table, then
/// in `folder`. Only images in `folder` or below are returned, in the table's order.
///
/// Throws InputError for a table that cannot be read, missing or duplicate columns, fields that are not numbers or out of
/// range, depression and incidence that contradict each other, an image listed twice, and, by name, files that do not
/// exist. Part of the target sarnerf::dataset_import.
std::vector<IndexedImage> read_image_index(const std::filesystem::path& table,
                                           const std::filesystem::path& folder);

/// Image files (PNG, JPEG, TIFF) of the folder and those below it, in the order of their names. Datasets below it are
/// skipped: an earlier import of the folder may have written them.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// Index from file names that begin with the azimuth (deg) and an underscore, such as 50.2248_HB15087.tif. Throws an
/// InputError that names the folder's other images.
std::vector<IndexedImage> index_by_names(const std::filesystem::path& folder);

}  // namespace sarnerf

namespace sarnerf {

/// Reads a measured or synthetic chip of the SAMPLE set, a MATLAB file of version 5 with complex_img, azimuth,
/// elevation (its depression, deg), range_pixel_spacing, xrange_pixel_spacing (m) and target_name. Its array, as MATLAB
/// shows it, is the transpose of an MSTAR chip; transposed, it is read as chip_of() reads those. SAMPLE publishes no
/// ranges: `assumed_range_m` is used instead. The serial is taken from the file's name ("…_serial_b01.mat").
///
/// Throws InputError for other files, files of version 7.3 (HDF5), truncated ones, variables that are missing or of
/// another type or size, and pixels that are not finite. Part of the target sarnerf::dataset_import.
Chip read_sample(const std::filesystem::path& path, double assumed_range_m);

}  // namespace sarnerf
