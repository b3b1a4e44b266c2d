// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_file.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>

#include "codec.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"

namespace sarnerf {

namespace {

/// Reads whole numbers anywhere in the file, in either byte order. Throws InputError instead of reading beyond its end.
class HeaderBytes {
 public:
  HeaderBytes(std::span<const std::byte> bytes, const std::string& where) : bytes_(bytes), where_(where) {}

  std::uint64_t number(std::uint64_t at, unsigned n_bytes) const {
    if (at > bytes_.size() || bytes_.size() - at < n_bytes) cut_off();
    std::uint64_t value = 0;
    for (unsigned n = 0; n < n_bytes; ++n) {
      const std::uint64_t place = at + (big_endian ? n : n_bytes - 1 - n);
      value = (value << 8) | std::to_integer<std::uint64_t>(bytes_[static_cast<std::size_t>(place)]);
    }
    return value;
  }

  bool begins_with(std::initializer_list<unsigned> first) const {
    return bytes_.size() >= first.size() &&
           std::equal(first.begin(), first.end(), bytes_.begin(),
                      [](unsigned a, std::byte b) { return a == std::to_integer<unsigned>(b); });
  }

  [[noreturn]] void cut_off() const {
    throw InputError(where_ + ": expected a complete image, found the end of the file in its header; the file is "
                              "cut off or damaged");
  }

  bool big_endian = true;

 private:
  std::span<const std::byte> bytes_;
  const std::string& where_;
};

ImageHeader read_png(const HeaderBytes& bytes) {
  ImageHeader header{ImageHeader::Format::png, bytes.number(20, 4), bytes.number(16, 4)};
  const std::uint64_t bits = bytes.number(24, 1), colour_type = bytes.number(25, 1);
  const std::uint64_t n_channels = colour_type == 0 ? 1 : colour_type == 4 || colour_type == 6 ? 4 : 3;
  header.n_bytes = header.n_rows * header.n_columns * n_channels * (bits == 16 ? 2 : 1);
  return header;
}

/// Walks over the segments and, as decoders do, skips any bytes between them.
ImageHeader read_jpeg(const HeaderBytes& bytes) {
  ImageHeader header{ImageHeader::Format::jpeg};
  header.n_scans = 0;
  std::uint64_t at = 2;
  try {
    while (true) {
      while (bytes.number(at++, 1) != 0xff) {}
      std::uint64_t marker = 0xff;
      while (marker == 0xff) marker = bytes.number(at++, 1);
      if (marker == 0xd9) break;                                                        // end of the image
      if (marker <= 0x01 || (marker >= 0xd0 && marker <= 0xd8)) continue;               // without a length
      const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
      if (frame && header.n_bytes == 0) {
        header.n_rows = bytes.number(at + 3, 2);
        header.n_columns = bytes.number(at + 5, 2);
        header.n_bytes = header.n_rows * header.n_columns * bytes.number(at + 7, 1);
      }
      if (marker == 0xda) ++header.n_scans;
      at += bytes.number(at, 2);
    }
  } catch (const InputError&) {
    // Decoders show the part that they have of a file that ends early.
    if (header.n_bytes == 0) throw;
  }
  return header;
}

/// The sizes in a TIFF directory. Of several values with the same tag, the largest.
struct TiffSizes {
  std::uint64_t columns = 0, rows = 0, channels = 1, bits = 1;
  std::uint64_t rows_per_strip = 0, tile_columns = 0, tile_rows = 0;

  std::uint64_t* of_tag(std::uint64_t tag) {
    switch (tag) {
      case 256: return &columns;
      case 257: return &rows;
      case 258: return &bits;
      case 277: return &channels;
      case 278: return &rows_per_strip;
      case 322: return &tile_columns;
      case 323: return &tile_rows;
      default: return nullptr;
    }
  }
};

unsigned bytes_of_type(std::uint64_t type) {
  return type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
}

ImageHeader read_tiff(HeaderBytes& bytes) {
  bytes.big_endian = bytes.begins_with({'M'});
  const bool big_tiff = bytes.number(2, 2) == 43;
  const unsigned offset_bytes = big_tiff ? 8 : 4, count_bytes = big_tiff ? 8 : 2;
  const std::uint64_t directory = bytes.number(big_tiff ? 8 : 4, offset_bytes);
  const std::uint64_t n_entries = bytes.number(directory, count_bytes);
  const unsigned entry_bytes = big_tiff ? 20 : 12;
  TiffSizes sizes;
  for (std::uint64_t n = 0; n < n_entries; ++n) {
    const std::uint64_t entry = directory + count_bytes + n * entry_bytes;
    std::uint64_t* size = sizes.of_tag(bytes.number(entry, 2));
    const unsigned value_bytes = bytes_of_type(bytes.number(entry + 2, 2));
    if (size == nullptr || value_bytes == 0) continue;
    const std::uint64_t n_values = bytes.number(entry + 4, offset_bytes);
    const std::uint64_t value = entry + 4 + offset_bytes;
    const bool inside = n_values <= offset_bytes / value_bytes;
    *size = std::max(*size, bytes.number(inside ? value : bytes.number(value, offset_bytes), value_bytes));
  }

  constexpr std::uint64_t kMost = 0xffffffff;  // products of two such numbers fit into 64 bits
  const auto within = [&](std::uint64_t value) { return std::min(value, kMost); };
  ImageHeader header{ImageHeader::Format::tiff, within(sizes.rows), within(sizes.columns)};
  std::uint64_t n_pixels = header.n_rows * header.n_columns;
  // A strip of 2^32 - 1 rows commonly means: all rows.
  if (sizes.rows_per_strip < kMost) n_pixels = std::max(n_pixels, sizes.rows_per_strip * header.n_columns);
  n_pixels = std::max(n_pixels, within(sizes.tile_rows) * within(sizes.tile_columns));
  const std::uint64_t n_bytes = (std::min<std::uint64_t>(sizes.bits, 64) + 7) / 8;
  const std::uint64_t pixel_bytes = std::min<std::uint64_t>(sizes.channels, 0xffff) * n_bytes;
  header.n_bytes = n_pixels > kMost * 0xff ? n_pixels : n_pixels * pixel_bytes;
  return header;
}

/// Largest ratio of decoded bytes to file bytes, reached by a picture of one value: 1,032 for deflate, 1,340 for LZW;
/// a JPEG scan takes one bit for 64 pixels.
std::uint64_t best_compression(ImageHeader::Format format) {
  return format == ImageHeader::Format::jpeg ? 512 : 1400;
}

}  // namespace

ImageHeader read_image_header(std::span<const std::byte> bytes, const std::string& where) {
  HeaderBytes reader(bytes, where);
  if (reader.begins_with({0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a})) return read_png(reader);
  if (reader.begins_with({0xff, 0xd8, 0xff})) return read_jpeg(reader);
  for (const unsigned version : {42u, 43u}) {
    if (reader.begins_with({'I', 'I', version, 0}) || reader.begins_with({'M', 'M', 0, version})) {
      return read_tiff(reader);
    }
  }
  throw InputError(where + ": expected a TIFF, PNG or JPEG image; the file is damaged or something else");
}

void require_plausible(const ImageHeader& header, std::size_t file_bytes, const std::string& where) {
  const auto refuse = [&](const std::string& found) {
    throw InputError(where + ": expected an image, found a header that promises " + found + " in a file of " +
                     std::to_string(file_bytes) + " bytes; the file is damaged");
  };
  constexpr std::uint64_t kLongestSide = 1u << 20;  // OpenCV's own limit
  if (header.n_rows > kLongestSide || header.n_columns > kLongestSide) {
    refuse(std::to_string(header.n_rows) + " x " + std::to_string(header.n_columns) + " pixels");
  }
  // Below this, the format's overhead outweighs the pixels: the ratio is not checked.
  constexpr std::uint64_t kAlwaysFine = 1u << 20;
  if (header.n_bytes > std::max(kAlwaysFine, best_compression(header.format) * file_bytes)) {
    refuse(std::to_string(header.n_bytes) + " bytes for " + std::to_string(header.n_rows) + " x " +
           std::to_string(header.n_columns) + " pixels");
  }
  // Progressive files have about ten scans. Each is another pass over the picture.
  constexpr int kMostScans = 32;
  if (header.n_scans > kMostScans) refuse(std::to_string(header.n_scans) + " scans");
}

namespace {

std::string read_bytes(const std::filesystem::path& path) {
  if (regular_file_size(path) > kMostImageFileBytes) {
    throw InputError(path.string() + ": expected an image below 2 GiB");
  }
  return read_whole_file(path);
}

/// One value of a pixel whose channels must agree (a grey picture stored in colour).
template <class T>
float grey_value(const T* pixel, int channels, const std::string& where) {
  if (channels >= 3 && !(pixel[0] == pixel[1] && pixel[1] == pixel[2])) {
    throw InputError(where + ": expected a grey image, found colours; convert it to one channel");
  }
  if (channels == 4 && pixel[3] != std::numeric_limits<T>::max()) {
    throw InputError(where + ": expected an opaque image, found transparency; remove the alpha channel");
  }
  return static_cast<float>(pixel[0]);
}

template <class T>
Image<float> from_mat(const cv::Mat& mat, const std::string& where) {
  const int channels = mat.channels();
  Image<float> image(mat.rows, mat.cols);
  for (int row = 0; row < mat.rows; ++row) {
    const T* pixel = mat.ptr<T>(row);
    for (int column = 0; column < mat.cols; ++column, pixel += channels) {
      const float value = grey_value(pixel, channels, where);
      if (!std::isfinite(value)) {
        throw InputError(where + ": expected finite pixels, found " + std::to_string(value) +
                         " in row " + std::to_string(row) + ", column " + std::to_string(column));
      }
      image(row, column) = value;
    }
  }
  return image;
}

template <class T>
std::vector<std::byte> tiff_of(const Image<T>& image, int type) {
  if (image.pixels().empty()) throw UsageError("an image file needs at least one pixel");
  const cv::Mat mat(image.n_azimuth(), image.n_range(), type, const_cast<T*>(image.pixels().data()));
  // OpenCV's default compression depends on the type of the pixels; 1 is none.
  return encode(".tif", mat, {cv::IMWRITE_TIFF_COMPRESSION, 1});
}

}  // namespace

std::vector<std::byte> encode_tiff(const Image<float>& image) { return tiff_of(image, CV_32FC1); }

std::vector<std::byte> encode_tiff(const Image<std::uint8_t>& image) { return tiff_of(image, CV_8UC1); }

ImageSize read_image_size(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  const ImageHeader header = read_image_header(std::as_bytes(std::span(bytes)), path.string());
  require_plausible(header, bytes.size(), path.string());
  return {header.n_rows, header.n_columns, header.n_bytes};
}

Image<float> read_image(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  return decode_image(std::as_bytes(std::span(bytes)), path.string());
}

Image<float> decode_image(std::span<const std::byte> bytes, const std::string& where) {
  const cv::Mat mat = decode(bytes, where);
  const int channels = mat.channels();
  if (channels == 2 || channels > 4 || (channels > 1 && mat.depth() >= CV_32F)) {
    throw InputError(where + ": expected one channel, found " + std::to_string(channels));
  }
  switch (mat.depth()) {
    case CV_8U:
      return from_mat<std::uint8_t>(mat, where);
    case CV_16U:
      return from_mat<std::uint16_t>(mat, where);
    case CV_32F:
      return from_mat<float>(mat, where);
    case CV_64F:
      return from_mat<double>(mat, where);
    default:
      throw InputError(where + ": expected 8- or 16-bit codes or floating-point pixels, found type " +
                       cv::typeToString(mat.type()));
  }
}

Image<Colour> read_picture(const std::filesystem::path& path) {
  const std::string bytes = read_bytes(path);
  const cv::Mat mat = decode(std::as_bytes(std::span(bytes)), path.string());
  if (mat.depth() != CV_8U || mat.channels() == 2)
    throw InputError(path.string() + ": expected an 8-bit picture, found type " + cv::typeToString(mat.type()));
  Image<Colour> picture(mat.rows, mat.cols);
  const int n = mat.channels();
  for (int row = 0; row < mat.rows; ++row)
    for (int column = 0; column < mat.cols; ++column) {
      const std::uint8_t* const c = mat.ptr(row) + column * n;
      picture(row, column) = n == 1 ? Colour{c[0], c[0], c[0]} : Colour{c[2], c[1], c[0]};
    }
  return picture;
}

}  // namespace sarnerf
