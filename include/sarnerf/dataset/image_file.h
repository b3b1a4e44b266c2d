// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Files of more bytes are not read: decoders count in int.
inline constexpr std::uint64_t kMostImageFileBytes = (std::uint64_t(1) << 31) - 1;

/// The bytes of a one-channel float32 TIFF without compression: every value comes back bit for bit.
/// Rows and columns are those of the image. Depends on nothing but the pixels. About 4 bytes a pixel.
std::vector<std::byte> encode_tiff(const Image<float>& image);

/// The same of an 8-bit image.
std::vector<std::byte> encode_tiff(const Image<std::uint8_t>& image);

/// What the header of an image file promises.
struct ImageSize {
  std::uint64_t n_rows = 0, n_columns = 0;
  std::uint64_t decoded_bytes = 0;  ///< of the largest piece that is decoded at once
};

/// Reads the header of a file of read_image(). Throws InputError as that does.
ImageSize read_image_size(const std::filesystem::path& path);

/// Reads a float32 or float64 TIFF, or an 8- or 16-bit PNG, JPEG or TIFF. Integer codes become floats
/// of the same value (physical value = code × the dataset's scale); colour files are accepted where
/// they are grey. Rows and columns are those of the file: a dataset's `axes` say what they mean.
/// Throws InputError for a missing, damaged, coloured, transparent or multi-channel file and for values
/// that are not finite.
Image<float> read_image(const std::filesystem::path& path);

/// The same of a file's bytes; `where` names them in messages.
Image<float> decode_image(std::span<const std::byte> bytes, const std::string& where);

}  // namespace sarnerf
