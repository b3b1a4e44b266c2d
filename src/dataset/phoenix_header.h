// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace sarnerf {

/// The "Name= value" lines of a Phoenix header. Every complaint is an InputError that names file and field.
class PhoenixHeader {
 public:
  /// From the beginning of a file up to "[EndofPhoenixHeader]".
  PhoenixHeader(std::string_view file, std::string where);

  /// Bytes up to and including the header's last line.
  std::size_t size() const { return size_; }

  std::string text(std::string_view name) const;  ///< empty when missing
  std::optional<double> number(std::string_view name) const;
  double positive_number(std::string_view name) const;
  std::size_t whole_number(std::string_view name, std::size_t least, std::size_t most) const;

  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string where_;
  std::size_t size_ = 0;
  std::map<std::string, std::string, std::less<>> fields_;
};

}  // namespace sarnerf
