// SPDX-License-Identifier: Apache-2.0
#include "mat_layout.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr std::size_t kHeaderBytes = 128, kTagBytes = 8;
constexpr std::uint32_t kInt8 = 1, kInt32 = 5, kUint32 = 6, kMatrix = 14, kCompressed = 15,
                        kUtf8 = 16, kUtf32 = 18, kComplexFlag = 0x800;

constexpr std::uint32_t kMostSide = 2048, kLongestName = 63;

/// Real and imaginary parts in double precision, and what stands around them.
constexpr std::size_t kMostMatrixBytes = 2 * sizeof(double) * kMostSide * kMostSide + 1024;

/// Classes of arrays: texts and numbers of every kind; not cells, structures, objects, sparse matrices.
constexpr std::uint32_t kCharacters = 4, kFirstNumber = 6, kLastNumber = 15;

class Words {
 public:
  Words(std::string_view bytes, bool little_endian)
      : bytes_(bytes), little_endian_(little_endian) {}

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

/// What a compressed variable unzips to; empty where it does not, or to too much.
std::string unzipped(std::string_view zipped) {
  std::string bytes(std::min(kMostMatrixBytes, 1032 * zipped.size() + 64),
                    '\0');  // zlib's highest ratio
  auto n_bytes = static_cast<uLongf>(bytes.size());
  const int result =
      uncompress(reinterpret_cast<Bytef*>(bytes.data()), &n_bytes,
                 reinterpret_cast<const Bytef*>(zipped.data()), static_cast<uLong>(zipped.size()));
  bytes.resize(result == Z_OK ? n_bytes : 0);
  return bytes;
}

/// Bytes of one value of a data type; 0 for what is no number and no character.
std::size_t size_of(std::uint32_t type) {
  constexpr std::array<std::size_t, 19> kSizes{0, 1, 1, 2, 2, 4, 4, 4, 0, 8,
                                               0, 0, 8, 8, 0, 0, 1, 2, 4};
  return type < kSizes.size() ? kSizes[type] : 0;
}

struct Part {
  std::uint32_t type = 0;
  std::size_t begin = 0, n_bytes = 0;
};

/// The parts of a matrix one after the other: small ones have type and size in one word and their data in the next;
/// the others fill up to eight bytes. Empty where they do not end with the matrix.
std::vector<Part> parts_of(std::string_view matrix, const Words& words) {
  std::vector<Part> parts;
  for (std::size_t at = kTagBytes; at < matrix.size();) {
    if (matrix.size() - at < kTagBytes || parts.size() == 5) return {};
    const std::uint32_t word = words.at(at);
    const bool small = (word >> 16) != 0;
    const Part part{word & 0xffff, at + (small ? 4 : 8), small ? word >> 16 : words.at(at + 4)};
    if (part.n_bytes > (small ? 4 : matrix.size() - at - kTagBytes)) return {};
    at += kTagBytes + (small ? 0 : (part.n_bytes + 7) / 8 * 8);
    parts.push_back(part);
  }
  return parts;
}

bool is_plain_matrix(std::string_view matrix, bool little_endian) {
  const Words words(matrix, little_endian);
  if (matrix.size() < kTagBytes || words.at(0) != kMatrix ||
      words.at(4) != matrix.size() - kTagBytes)
    return false;
  const std::vector<Part> parts = parts_of(matrix, words);
  if (parts.size() < 4) return false;
  const Part &flags = parts[0], &sides = parts[1], &name = parts[2];
  if (flags.type != kUint32 || flags.n_bytes != 8 || sides.type != kInt32 || sides.n_bytes != 8 ||
      name.type != kInt8 || name.n_bytes > kLongestName)
    return false;
  const std::uint32_t array_class = words.at(flags.begin) & 0xff;
  const bool is_text = array_class == kCharacters,
             is_complex = (words.at(flags.begin) & kComplexFlag) != 0;
  if (!is_text && !(array_class >= kFirstNumber && array_class <= kLastNumber)) return false;
  const std::uint32_t n_rows = words.at(sides.begin), n_columns = words.at(sides.begin + 4);
  if (n_rows > kMostSide || n_columns > kMostSide || parts.size() != (is_complex ? 5u : 4u))
    return false;
  return std::all_of(parts.begin() + 3, parts.end(), [&](const Part& data) {
    const std::size_t n_values = std::size_t{n_rows} * n_columns, size = size_of(data.type);
    // A character of UTF-8 has up to four bytes.
    if (is_text && data.type == kUtf8)
      return data.n_bytes >= n_values && data.n_bytes <= 4 * n_values;
    return size > 0 && data.type < (is_text ? kUtf32 + 1 : kUtf8) &&
           data.n_bytes == size * n_values;
  });
}

}  // namespace

void check_mat_layout(std::string_view file, const std::string& where) {
  const auto fail = [&](const std::string& what) { throw InputError(where + ": " + what); };
  if (file.starts_with("\x89HDF\r\n") || file.starts_with("MATLAB 7.3"))
    fail(
        "this is a MATLAB file of version 7.3 (HDF5), which is not read; save it with -v7 in "
        "MATLAB");
  if (!file.starts_with("MATLAB 5.0") || file.size() < kHeaderBytes)
    fail("expected a MATLAB file of version 5, which begins with MATLAB 5.0");
  const std::string_view order = file.substr(kHeaderBytes - 2, 2);
  if (order != "IM" && order != "MI")
    fail("the header of the MATLAB file is damaged: no byte order");
  const bool little_endian = order == "IM";
  if (file.substr(kHeaderBytes - 4, 2) !=
      (little_endian ? std::string_view("\0\1", 2) : std::string_view("\1\0", 2)))
    fail("the header of the MATLAB file is damaged: expected version 0x0100");
  const Words words(file, little_endian);
  for (std::size_t at = kHeaderBytes; at < file.size();) {
    if (file.size() - at < kTagBytes)
      fail("the file is truncated in the middle of a variable's tag");
    const std::uint32_t type = words.at(at), n_bytes = words.at(at + 4);
    const std::size_t end = at + kTagBytes + n_bytes;
    if (type != kMatrix && type != kCompressed)
      fail("byte " + std::to_string(at) + ": expected a variable; the file is damaged");
    if (end > file.size())
      fail("the file is truncated: a variable ends at byte " + std::to_string(end) +
           ", the file at byte " + std::to_string(file.size()));
    const std::string_view element = file.substr(at, end - at);
    const bool plain = type == kMatrix
                           ? is_plain_matrix(element, little_endian)
                           : is_plain_matrix(unzipped(element.substr(kTagBytes)), little_endian);
    if (!plain)
      fail("the variable at byte " + std::to_string(at) + " is no text and no matrix of at most " +
           std::to_string(kMostSide) + " x " + std::to_string(kMostSide) + " numbers, or damaged");
    at = end;
  }
}

}  // namespace sarnerf
