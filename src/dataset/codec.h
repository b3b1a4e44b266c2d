// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

namespace sarnerf {

/// OpenCV's encoder into memory. Its exceptions become Error.
std::vector<std::byte> encode(const char* extension, const cv::Mat& mat,
                              const std::vector<int>& parameters);

/// OpenCV's decoder. Keeps the file's depth and channels. Checks the header first: read_image_header(),
/// require_plausible(). Throws InputError with `where`.
cv::Mat decode(std::span<const std::byte> bytes, const std::string& where);

/// The header of an image file. Decoders trust it: a file of a hundred bytes can make them allocate gigabytes.
struct ImageHeader {
  enum class Format { png, jpeg, tiff };
  Format format = Format::png;
  std::uint64_t n_rows = 0, n_columns = 0;
  /// Decoded size of the largest piece that is decoded at once: the picture, or a larger strip or tile.
  std::uint64_t n_bytes = 0;
  int n_scans = 1;  ///< passes over all pixels, of progressive JPEG
};

/// Reads the header of a PNG, JPEG or TIFF file, BigTIFF included, recognised by its first bytes. Throws InputError
/// with `where` for other files and for headers that are cut off. Cost: a pass over the bytes of a JPEG file,
/// less for others.
ImageHeader read_image_header(std::span<const std::byte> bytes, const std::string& where);

/// Throws InputError for a picture that the file cannot hold, however well it is compressed, and for one that
/// takes a decoder too long for its size.
void require_plausible(const ImageHeader& header, std::size_t file_bytes, const std::string& where);

}  // namespace sarnerf
