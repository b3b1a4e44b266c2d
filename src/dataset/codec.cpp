// SPDX-License-Identifier: Apache-2.0
#include "codec.h"

#include <opencv2/core/utils/logger.hpp>

#include "image_header.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// OpenCV prints codec warnings by itself; a library must not, and what matters comes back as an error.
void silence_opencv() {
  static const auto previous = cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  (void)previous;
}

}  // namespace

std::vector<std::byte> encode(const char* extension, const cv::Mat& mat,
                              const std::vector<int>& parameters) {
  silence_opencv();
  std::vector<unsigned char> bytes;
  try {
    if (!cv::imencode(extension, mat, bytes, parameters)) {
      throw Error(std::string("an image could not be encoded as ") + extension);
    }
  } catch (const cv::Exception& e) {
    throw Error(std::string("an image could not be encoded as ") + extension + ": " + e.err);
  }
  const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
  return {first, first + bytes.size()};
}

cv::Mat decode(std::span<const std::byte> bytes, const std::string& where) {
  silence_opencv();
  if (bytes.empty()) throw InputError(where + ": expected an image, found an empty file");
  require_plausible(read_image_header(bytes, where), bytes.size(), where);
  // A const view suffices: the decoder only reads.
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1,
                        const_cast<std::byte*>(bytes.data()));
  cv::Mat mat;
  try {
    mat = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    throw InputError(where + ": the image cannot be decoded: " + e.err);
  }
  if (mat.empty()) {
    throw InputError(where + ": expected a TIFF, PNG or JPEG image; the file is damaged");
  }
  return mat;
}

}  // namespace sarnerf
