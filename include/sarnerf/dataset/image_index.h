// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sarnerf/dataset/manifest.h"
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

/// A text as a field of such a table: quoted where it holds a comma, a quote or a line break.
std::string csv_field(const std::string& text);

/// Image files (PNG, JPEG, TIFF) of the folder and those below it, in the order of their names. Datasets below it are
/// skipped: an earlier import of the folder may have written them.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// Index from file names that begin with the azimuth (deg) and an underscore, such as 50.2248_HB15087.tif. Throws an
/// InputError that names the folder's other images.
std::vector<IndexedImage> index_by_names(const std::filesystem::path& folder);

/// What is not in the index, for all images alike.
struct PictureRule {
  double slant_range_m = 4500.0;  ///< used if the index gives none
  std::optional<std::pair<double, double>> spacing_m;  ///< azimuth, range; used if the index gives none
  double scale = 1.0;             ///< physical value of one pixel code
  /// Of the rows and columns of the file. Default: those of MSTAR's pictures, rows from far to near range, the radar below.
  std::array<Axis, 2> axes{Axis::minus_j, Axis::minus_i};
};

/// The chip of an indexed image, without its pixels and size; depression 0 if it is not known. Throws UsageError if the pixel
/// spacing is not known.
Chip chip_of(const IndexedImage& indexed, const PictureRule& rule);

/// Reads the chip's pixels, and its size. Throws InputError for a damaged file, and for pixels that are negative or, scaled, not
/// finite.
void read_pixels(Chip& chip, const std::filesystem::path& file, const PictureRule& rule);

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
