// SPDX-License-Identifier: Apache-2.0
#include "codec.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <unistd.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf {

namespace {

/// Stops OpenCV from printing codec warnings: a library must not print, and real failures are returned as errors.
void silence_opencv() {
  static const auto previous = cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  (void)previous;
}

/// The PNG and JPEG libraries behind OpenCV print their own warnings to stderr, and OpenCV cannot stop them. While at least
/// one object of this class exists, in any thread, file descriptor 2 is /dev/null. Programs that would lose their own
/// messages write to a copy of stderr (apps/common/console.h).
class SilentStderr {
 public:
  SilentStderr() {
    const std::scoped_lock lock(mutex());
    if (n_alive()++ > 0) return;
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION  // when fuzzing, sanitizer reports must stay visible
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere < 0) return;
    saved() = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    if (saved() >= 0) ::dup2(nowhere, STDERR_FILENO);
    ::close(nowhere);
#endif
  }
  ~SilentStderr() {
    const std::scoped_lock lock(mutex());
    if (--n_alive() > 0 || saved() < 0) return;
    ::dup2(saved(), STDERR_FILENO);
    ::close(std::exchange(saved(), -1));
  }
  SilentStderr(const SilentStderr&) = delete;
  SilentStderr& operator=(const SilentStderr&) = delete;

 private:
  // Static: a process has one stderr.
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static int& n_alive() {
    static int n = 0;
    return n;
  }
  static int& saved() {
    static int fd = -1;
    return fd;
  }
};

/// Whether a JPEG file ends within its last scan. The JPEG library would fill the rest with grey and only print a warning.
/// Within a scan's data, 0xFF is followed by 0 or a restart marker, so 0xFFD9 after the last start of a scan (0xFFDA) is a
/// true end marker.
bool is_cut_jpeg(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with("\xFF\xD8\xFF")) return false;
  const auto scan = text.rfind("\xFF\xDA"), end = text.rfind("\xFF\xD9");
  return scan == std::string_view::npos || end == std::string_view::npos || end < scan;
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
  if (is_cut_jpeg(bytes)) throw InputError(where + ": the JPEG image has no end; the file is truncated");
  // A const view suffices: the decoder only reads.
  const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8UC1,
                        const_cast<std::byte*>(bytes.data()));
  cv::Mat mat;
  try {
    const SilentStderr silent;
    mat = cv::imdecode(encoded, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    throw InputError(where + ": the image cannot be decoded: " + e.err);
  }
  if (mat.empty()) {
    throw InputError(where + ": expected a TIFF, PNG or JPEG image; the file is damaged");
  }
  return mat;
}

float white_level(const Image<float>& image, const DisplayRange& range) {
  std::vector<float> positive;
  positive.reserve(image.pixels().size());
  for (const float p : image.pixels()) {
    if (p > 0.0f) positive.push_back(p);
  }
  if (positive.empty()) return 0.0f;
  return quantile_reached(positive, range.percentile / 100.0);
}

double level_db(float level, Quantity quantity) {
  return (quantity == Quantity::power ? 10.0 : 20.0) * std::log10(double(level));
}

Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity,
                                   const DisplayRange& range) {
  return display_levels(image, quantity, white_level(image, range), range);
}

Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity, float white,
                                   const DisplayRange& range) {
  Image<std::uint8_t> levels(image.n_azimuth(), image.n_range(), 0);
  if (!(white > 0.0f)) return levels;
  const float db_per_decade = quantity == Quantity::power ? 10.0f : 20.0f;
  const float levels_per_decade = db_per_decade * 255.0f / static_cast<float>(range.range_db);
  for (std::size_t n = 0; n < image.pixels().size(); ++n) {
    const float p = image.pixels()[n];
    if (!(p > 0.0f)) continue;
    const float level = 255.0f + levels_per_decade * std::log10(p / white);
    levels.pixels()[n] = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0f, 255.0f)));
  }
  return levels;
}

std::vector<std::byte> encode_png(const Image<std::uint8_t>& levels) {
  const cv::Mat mat(levels.n_azimuth(), levels.n_range(), CV_8UC1,
                    const_cast<std::uint8_t*>(levels.pixels().data()));
  // Level 1 with run lengths takes a fifth of the default's time, and still compresses shadow and background to almost nothing.
  return encode(".png", mat,
                {cv::IMWRITE_PNG_COMPRESSION, 1, cv::IMWRITE_PNG_STRATEGY,
                 cv::IMWRITE_PNG_STRATEGY_RLE});
}

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
