// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace sarnerf {

/// Takes the next run of characters that are not blank from the front of `rest`; empty at its end.
std::string_view take_token(std::string_view& rest);

/// The whole token as a number, independent of the locale. "nan" and "inf" are numbers; what
/// overflows is infinite, what underflows is zero.
std::optional<double> parse_real(std::string_view token);

/// The whole token as an integer, with an optional sign.
std::optional<std::int64_t> parse_integer(std::string_view token);

/// Walks over a text and knows the line it is in, so that errors can name it.
class TextCursor {
 public:
  /// Lines end as the first one does: by "\n", with or without "\r" before it, or by "\r" alone, as old
  /// Macintosh programs write them.
  explicit TextCursor(std::string_view text);

  /// Next line without its end; false at the end of the text.
  bool next_line(std::string_view& line);

  /// Next token, on this line or a later one; empty at the end of the text.
  std::string_view next_token();

  std::uint64_t line_number() const { return line_number_; }  ///< of what was returned last, from 1
  std::size_t position() const { return position_; }          ///< bytes passed
  std::size_t remaining() const { return text_.size() - position_; }

 private:
  std::string_view text_;
  char line_end_;
  std::size_t position_ = 0;
  std::uint64_t line_number_ = 0;
  bool in_line_ = false;  ///< next_token() has begun the line
};

}  // namespace sarnerf
