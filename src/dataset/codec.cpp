// SPDX-License-Identifier: Apache-2.0
#include "codec.h"

#include <fcntl.h>
#include <unistd.h>

#include <mutex>
#include <opencv2/core/utils/logger.hpp>
#include <string_view>
#include <utility>

#include "image_header.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// OpenCV prints codec warnings by itself; a library must not, and what matters comes back as an error.
void silence_opencv() {
  static const auto previous = cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  (void)previous;
}

/// The PNG and JPEG libraries behind OpenCV print what they think of a file to stderr, in words of their own, and OpenCV
/// gives no way to stop them. While one of these objects lives, file descriptor 2 leads nowhere; threads share the time.
/// Programs that would lose messages of their own write to a copy of it (apps/common/console.h).
class SilentStderr {
 public:
  SilentStderr() {
    const std::scoped_lock lock(mutex());
    if (n_alive()++ > 0) return;
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION  // there, what sanitizers find must be seen
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
  // A process has one stderr.
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

/// Whether a JPEG file ends within its last scan: its library fills in grey and only prints a warning. Within the data of a scan
/// 0xFF is followed by 0 or a restart marker, so that an end marker (0xFFD9) behind the last start of a scan (0xFFDA) is one.
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

}  // namespace sarnerf
