// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_file.h"

#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "codec.h"
#include "image_header.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/input_file.h"

namespace sarnerf {
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

}  // namespace sarnerf
