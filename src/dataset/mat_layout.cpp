// SPDX-License-Identifier: Apache-2.0
#include "mat_layout.h"

#include <zlib.h>

#include <array>
#include <cstdint>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr std::size_t kHeaderBytes = 128, kTagBytes = 8;
constexpr std::uint32_t kInt8 = 1, kInt32 = 5, kUint32 = 6, kMatrix = 14, kCompressed = 15;

/// Tag, flags, dimensions and the name's tag of a matrix.
constexpr std::size_t kMatrixHeadBytes = 48;

constexpr std::uint32_t kMostSide = 2048, kLongestName = 63;

/// Classes of arrays: texts and numbers of every kind; not cells, structures, objects, sparse matrices.
constexpr std::uint32_t kCharacters = 4, kFirstNumber = 6, kLastNumber = 15;

class Words {
 public:
  Words(std::string_view bytes, bool little_endian) : bytes_(bytes), little_endian_(little_endian) {}

  std::uint32_t at(std::size_t place) const {
    std::uint32_t value = 0;
    for (std::size_t n = 0; n < 4; ++n)
      value = value << 8 | static_cast<unsigned char>(bytes_[place + (little_endian_ ? 3 - n : n)]);
    return value;
  }

 private:
  std::string_view bytes_;
  bool little_endian_;
};

/// The first bytes of what a compressed variable unzips to; fewer where it does not.
std::string unzipped_head(std::string_view zipped) {
  std::array<char, kMatrixHeadBytes> head{};
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(zipped.data()));
  stream.avail_in = static_cast<uInt>(zipped.size());
  stream.next_out = reinterpret_cast<Bytef*>(head.data());
  stream.avail_out = static_cast<uInt>(head.size());
  (void)inflate(&stream, Z_SYNC_FLUSH);
  const std::size_t n_bytes = head.size() - stream.avail_out;
  (void)inflateEnd(&stream);
  return {head.data(), n_bytes};
}

bool is_plain_matrix(std::string_view head, bool little_endian) {
  if (head.size() < kMatrixHeadBytes) return false;
  const Words words(head, little_endian);
  const std::uint32_t array_class = words.at(16) & 0xff, name_tag = words.at(40);
  const bool short_name = (name_tag >> 16) != 0;
  return words.at(0) == kMatrix && words.at(8) == kUint32 && words.at(12) == 8 &&
         (array_class == kCharacters || (array_class >= kFirstNumber && array_class <= kLastNumber)) &&
         words.at(24) == kInt32 && words.at(28) == 8 && words.at(32) <= kMostSide && words.at(36) <= kMostSide &&
         (short_name ? (name_tag & 0xffff) == kInt8 && (name_tag >> 16) <= 4
                     : name_tag == kInt8 && words.at(44) <= kLongestName);
}

}  // namespace

void check_mat_layout(std::string_view file, const std::string& where) {
  const auto fail = [&](const std::string& what) { throw InputError(where + ": " + what); };
  if (file.starts_with("\x89HDF\r\n") || file.starts_with("MATLAB 7.3"))
    fail("this is a MATLAB file of version 7.3 (HDF5), which is not read; save it with -v7 in MATLAB");
  if (!file.starts_with("MATLAB 5.0") || file.size() < kHeaderBytes)
    fail("expected a MATLAB file of version 5, which begins with MATLAB 5.0");
  const std::string_view order = file.substr(kHeaderBytes - 2, 2);
  if (order != "IM" && order != "MI") fail("the header of the MATLAB file is damaged: no byte order");
  const bool little_endian = order == "IM";
  if (file.substr(kHeaderBytes - 4, 2) != (little_endian ? std::string_view("\0\1", 2) : std::string_view("\1\0", 2)))
    fail("the header of the MATLAB file is damaged: expected version 0x0100");
  const Words words(file, little_endian);
  for (std::size_t at = kHeaderBytes; at < file.size();) {
    if (file.size() - at < kTagBytes) fail("the file is truncated in the middle of a variable's tag");
    const std::uint32_t type = words.at(at), n_bytes = words.at(at + 4);
    const std::size_t end = at + kTagBytes + n_bytes;
    if (type != kMatrix && type != kCompressed)
      fail("byte " + std::to_string(at) + ": expected a variable; the file is damaged");
    if (end > file.size())
      fail("the file is truncated: a variable ends at byte " + std::to_string(end) + ", the file at byte " +
           std::to_string(file.size()));
    const std::string_view element = file.substr(at, end - at);
    const bool plain = type == kMatrix ? is_plain_matrix(element, little_endian)
                                       : is_plain_matrix(unzipped_head(element.substr(kTagBytes)), little_endian);
    if (!plain)
      fail("the variable at byte " + std::to_string(at) + " is no text and no matrix of at most " +
           std::to_string(kMostSide) + " x " + std::to_string(kMostSide) + " numbers, or damaged");
    at = end;
  }
}

}  // namespace sarnerf
