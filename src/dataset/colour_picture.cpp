// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/colour_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "codec.h"

namespace sarnerf {

Image<Colour> colour_map(const Image<float>& values, float low, float high) {
  cv::Mat levels(1, 256, CV_8UC1), table;
  for (int n = 0; n < 256; ++n) levels.at<std::uint8_t>(0, n) = static_cast<std::uint8_t>(n);
  cv::applyColorMap(levels, table, cv::COLORMAP_VIRIDIS);
  Image<Colour> picture(values.n_azimuth(), values.n_range());
  for (std::size_t n = 0; n < picture.pixels().size(); ++n) {
    const float v = values.pixels()[n];
    if (!std::isfinite(v)) continue;
    const float level = high > low ? 255.0f * std::clamp((v - low) / (high - low), 0.0f, 1.0f) : 0.0f;
    const auto& bgr = table.at<cv::Vec3b>(0, static_cast<int>(std::lround(level)));
    picture.pixels()[n] = {bgr[2], bgr[1], bgr[0]};
  }
  return picture;
}

std::vector<std::byte> encode_png(const Image<Colour>& picture) {
  cv::Mat mat(picture.n_azimuth(), picture.n_range(), CV_8UC3);
  for (int row = 0; row < mat.rows; ++row) {
    for (int column = 0; column < mat.cols; ++column) {
      const Colour& c = picture(row, column);
      mat.at<cv::Vec3b>(row, column) = {c[2], c[1], c[0]};
    }
  }
  return encode(".png", mat, {cv::IMWRITE_PNG_COMPRESSION, 4});
}

}  // namespace sarnerf
