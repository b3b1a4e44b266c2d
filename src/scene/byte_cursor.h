// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "sarnerf/core/error.h"

namespace sarnerf {

/// Reads a binary file from memory, in the machine's byte order (little-endian, as OpenVDB writes).
/// Nothing is read beyond the end: every call throws InputError instead.
class ByteCursor {
 public:
  /// Bytes [begin, end) of the file. `file` is what messages call it; both must outlive the cursor.
  ByteCursor(std::string_view bytes, const std::string& file, std::size_t begin, std::size_t end)
      : bytes_(bytes.substr(0, end)), file_(file), at_(begin) {}

  std::size_t position() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

  std::string_view take(std::uint64_t n) {
    if (n > left()) {
      fail("the " + std::to_string(n) + " bytes that should follow reach beyond byte " +
           std::to_string(bytes_.size()));
    }
    const std::string_view found = bytes_.substr(at_, static_cast<std::size_t>(n));
    at_ += static_cast<std::size_t>(n);
    return found;
  }
  void skip(std::uint64_t n) { (void)take(n); }

  template <class T>
  T read() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }

  /// A 32-bit length and as many characters.
  std::string_view text() { return take(read<std::uint32_t>()); }

  /// Throws InputError: the file is damaged at this place.
  [[noreturn]] void fail(const std::string& found) const {
    throw InputError(file_ + ": expected a complete OpenVDB file, found damage at byte " +
                     std::to_string(at_) + ": " + found + "; copy or write the file again");
  }

 private:
  std::string_view bytes_;
  const std::string& file_;
  std::size_t at_;
};

}  // namespace sarnerf
