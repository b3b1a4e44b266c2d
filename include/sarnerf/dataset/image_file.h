// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// Files larger than this (bytes) are not read: decoders count in int.
inline constexpr std::uint64_t kMostImageFileBytes = (std::uint64_t(1) << 31) - 1;

/// The bytes of an uncompressed one-channel float32 TIFF. Every value is read back bit for bit. Rows and
/// columns are those of the image. The bytes depend on the pixels only. About 4 bytes a pixel.
std::vector<std::byte> encode_tiff(const Image<float>& image);

/// The same for an 8-bit image.
std::vector<std::byte> encode_tiff(const Image<std::uint8_t>& image);

/// Sizes stated in the header of an image file.
struct ImageSize {
  std::uint64_t n_rows = 0, n_columns = 0;
  std::uint64_t decoded_bytes = 0;  ///< of the largest piece that is decoded at once
};

/// Reads the header of a file that read_image() accepts. Throws InputError as read_image() does.
ImageSize read_image_size(const std::filesystem::path& path);

/// Reads a float32 or float64 TIFF, or an 8- or 16-bit PNG, JPEG or TIFF. Integer codes become floats
/// of the same value (physical value = code × the dataset's scale); colour files are accepted where
/// they are grey. Rows and columns are those of the file: a dataset's `axes` define their meaning.
/// Throws InputError for a missing, damaged, coloured, transparent or multi-channel file and for values
/// that are not finite.
Image<float> read_image(const std::filesystem::path& path);

/// The same for a file's bytes; `where` names them in messages.
Image<float> decode_image(std::span<const std::byte> bytes, const std::string& where);

/// Red, green, blue.
using Colour = std::array<std::uint8_t, 3>;

/// Maps values to the viridis colours, evenly brighter from `low` (dark violet) to `high` (yellow), clamped
/// beyond. Values that are not finite become black.
Image<Colour> colour_map(const Image<float>& values, float low, float high);

/// Reads an 8-bit picture, grey or coloured, without its transparency. Throws InputError for a file that is none.
Image<Colour> read_picture(const std::filesystem::path& path);

/// The bytes of an 8-bit colour PNG.
std::vector<std::byte> encode_png(const Image<Colour>& picture);

/// How a display picture maps brightness to grey.
struct DisplayRange {
  double range_db = 40.0;     ///< from white down to black
  double percentile = 99.9;   ///< of the pixels above zero, shown white: a few glints do not darken the rest
};

/// The value shown white: the percentile of the image's positive pixels; 0 for a blank image. O(pixels).
float white_level(const Image<float>& image, const DisplayRange& range = {});

/// A level in decibels: 10 log₁₀ of a power, 20 log₁₀ of an amplitude.
double level_db(float level, Quantity quantity);

/// Grey levels of an image in decibels: white at `white` and above, black at `range_db` below it and for
/// everything that is not positive. A blank image is black. The picture is for display; measurements need
/// the TIFF. Rows and columns keep their order: row 0 on top, near range on the left. Pictures that are to
/// be compared need the same white level.
Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity, float white,
                                   const DisplayRange& range = {});

/// The same with the image's own white level.
Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity,
                                   const DisplayRange& range = {});

/// The bytes of an 8-bit grey PNG, compressed fast rather than tightly: a sweep writes hundreds.
std::vector<std::byte> encode_png(const Image<std::uint8_t>& levels);

}  // namespace sarnerf
