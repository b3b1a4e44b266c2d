// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>
#include <vector>

namespace sarnerf {

/// OpenCV's encoder into memory. Its exceptions become Error.
std::vector<std::byte> encode(const char* extension, const cv::Mat& mat,
                              const std::vector<int>& parameters);

/// OpenCV's decoder, the file's own depth and channels kept, for headers that read_image_header() finds in order.
/// Throws InputError with `where`.
cv::Mat decode(std::span<const std::byte> bytes, const std::string& where);

}  // namespace sarnerf
