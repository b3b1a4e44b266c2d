// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <span>

#include "fuzz_target.h"
#include "sarnerf/dataset/image_file.h"

using namespace sarnerf;
using namespace sarnerf::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return read_or_refuse([&] {
    const Image<float> image = decode_image(std::as_bytes(std::span(data, size)), kName);
    require(image.n_azimuth() > 0 && image.n_range() > 0, "an image has pixels");
    for (const float pixel : image.pixels()) require(std::isfinite(pixel), "pixels are finite");
  });
}

#ifdef SARNERF_FUZZ
// Decoders of PNG stop at the first checksum that is wrong, so that plain mutations never get behind it. Here
// each chunk gets the right one again.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned seed);

namespace {

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320 : 0);
  }
  return ~crc;
}

void mend_checksums(std::span<std::uint8_t> png) {
  constexpr std::size_t kSignature = 8, kFrame = 12;  // length, type and checksum of a chunk
  for (std::size_t at = kSignature; png.size() - at >= kFrame;) {
    std::size_t length = 0;
    for (std::size_t n = 0; n < 4; ++n) length = length << 8 | png[at + n];
    if (length > png.size() - at - kFrame) return;
    const std::uint32_t crc = crc32(png.subspan(at + 4, length + 4));
    at += length + kFrame;
    for (std::size_t n = 0; n < 4; ++n) png[at - 4 + n] = static_cast<std::uint8_t>(crc >> (24 - 8 * n));
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned seed) {
  size = LLVMFuzzerMutate(data, size, most);
  const bool png = size > 8 && text_of(data, 4) == "\x89PNG";
  if (png && seed % 8 != 0) mend_checksums({data, size});
  return size;
}
#endif
